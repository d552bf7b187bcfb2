// Tables and pictures that go on beyond the edge say so, until their end has been seen.
for (const box of document.querySelectorAll(".wide, .strip, .drawn")) {
  const tell = () => box.classList.toggle("more", box.scrollLeft + box.clientWidth < box.scrollWidth - 2);
  box.addEventListener("scroll", tell, { passive: true });
  new ResizeObserver(tell).observe(box);
  box.querySelectorAll("img").forEach((picture) => picture.addEventListener("load", tell));
}
// Paper cannot be opened: what is folded is printed, and folded again.
let folded = [];
addEventListener("beforeprint", () => {
  folded = [...document.querySelectorAll("details:not([open])")];
  folded.forEach((one) => { one.open = true; });
});
addEventListener("afterprint", () => folded.forEach((one) => { one.open = false; }));
