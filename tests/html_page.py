"""What a page of HTML holds, for tests."""

from html.parser import HTMLParser

VOID = {"meta", "img", "br", "link", "input", "hr"}


class Page(HTMLParser):
    """Collects text, addresses, pictures and names, and checks that tags are closed in order.

    Attributes:
        addresses: of everything that the page refers to.
        pictures: (address, words for those who cannot see it) of every picture.
        names: what links within the page may lead to.
        tags: names of all elements.
    """

    def __init__(self, html: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.pictures: list[tuple[str, str]] = []
        self.names: list[str] = []
        self.tags: list[str] = []
        self._words: list[str] = []
        self._open: list[str] = []
        self.feed(html)
        assert not self._open

    @property
    def text(self) -> str:
        """All words, with single spaces."""
        return " ".join(" ".join(self._words).split())

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.addresses += [value for name, value in attributes if name in ("src", "href", "srcset", "data", "action")]
        self.names += [value for name, value in attributes if name == "id"]
        if tag == "img":
            found = dict(attributes)
            self.pictures.append((found["src"], found["alt"]))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        if not self._open or self._open[-1] not in ("style", "script"):
            self._words.append(data)
