"""The one held-out view that stands for all of them."""

import numpy as np
import torch

from rgspipe.datasets.views import View
from rgspipe.evaluation.images import comparison_strip
from rgspipe.evaluation.judgement import Renders
from rgspipe.scene import Camera


def test_the_typical_view_is_the_one_of_median_psnr():
    camera = Camera(torch.eye(4), 16.0, 16.0, 8.0, 8.0, 16, 16)
    truth = torch.rand(16, 16, 3, generator=torch.Generator().manual_seed(0))
    views = tuple(View(f"test/r_{index}", camera, truth * (1.0 + index), torch.ones(16, 16)) for index in range(4))
    errors = (0.3, 0.01, 0.1, 0.03)
    images = [view.image.numpy() * (1.0 + error) for view, error in zip(views, errors, strict=True)]
    # From the worst PSNR: 0.3, 0.1, 0.03, 0.01; the lower of the two in the middle is the third view.
    strip = Renders(views, {"pixels": images}, [], 1).typical("pixels")
    assert np.array_equal(strip, comparison_strip(views[2].image, images[2]))
