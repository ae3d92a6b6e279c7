"""The stroke alphabet."""

import numpy as np

from dirt_env.render.lettering import text


def test_text_is_a_coverage_as_wide_as_its_letters():
    line = text("share in goal 93 % (1.5 m³)", 10)
    assert line.dtype == np.float32
    assert line.min() == 0
    assert line.max() > 0.9
    assert line.shape[0] == text("x", 10).shape[0]
    assert line.shape[1] == sum(text(char, 10).shape[1] for char in "share in goal 93 % (1.5 m³)")


def test_letters_and_digits_differ():
    seen = {text(char, 12).tobytes() for char in "0123456789ABCDEFGHJKLMNPQRSTUVWXYZabcdefghijkmnopqrstuvwxyz"}
    assert len(seen) == 59


def test_nothing_and_unknown_characters():
    assert text("", 10).shape[1] > 0
    assert np.array_equal(text("€", 10), text("?", 10))
