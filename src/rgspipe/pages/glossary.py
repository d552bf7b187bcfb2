"""Words of the report that not everybody knows."""

#: In the order of the alphabet.
GLOSSARY = {
    "95 % region": "The ellipsoid around a recovered light that should hold the true one in 95 of 100 cases.",
    "albedo": "The fraction of light that a surface reflects diffusely, by red, green and blue.",
    "around the corner": "A light that reaches what the camera sees only by bouncing off other surfaces.",
    "fingerprint": "The name of a result: it follows from settings, inputs and code, and changes with any of them.",
    "frozen scene": "Surfels and how light travels between them, computed once; lights are looked for in it.",
    "HDR-FLIP": "How different two pictures look to people at the exposures that they need, 0 to 1; less is better.",
    "held-out view": "A photograph that training did not see, by which the trained scene is judged.",
    "intensity error": "By how much the recovered radiant intensity differs from the true one, mean of the colours.",
    "interreflection": "Light that bounces from surface to surface.",
    "occluded": "A light that is inside the picture, behind something.",
    "out of frame": "A light beside the picture; nothing hides it.",
    "position error": "From the recovered to the true place, as a fraction of the scene’s longest side.",
    "PSNR": "How near a picture comes to another, in dB; 20 dB more is a tenth of the error. More is better.",
    "solved": "A target with the right number of lights, each within the limit that the head of this page names.",
    "SSIM": "How alike the structure of two pictures is, up to 1; more is better.",
    "stated error": "The position error that the fit itself expects, from noise and from what it does not know.",
    "surfel": "A small disc of surface with place, direction, size and albedo; the scene is made of them.",
    "target": "A picture, or several of the same moment, in which lights are to be found.",
    "W/sr": "Watt per steradian: the power that a lamp sends into a direction; × 4π that of a lamp that shines evenly.",
}
