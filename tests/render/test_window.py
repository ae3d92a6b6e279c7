"""The window, on a screen that is not there."""

import sys

import numpy as np
import pytest

from dirt_env.render.window import Window

FRAME = np.full((60, 80, 3), (200, 100, 50), np.uint8)


@pytest.fixture
def pygame(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    return pytest.importorskip("pygame")


def test_shows_the_picture_and_closes_twice(pygame):
    window = Window("test")
    assert window.show(FRAME, 1000)
    assert window.show(FRAME, 1000)
    surface = pygame.display.get_surface()
    assert surface.get_size() == (80, 60)
    assert tuple(surface.get_at((40, 30)))[:3] == (200, 100, 50)
    assert not pygame.mixer or not pygame.mixer.get_init()
    window.close()
    window.close()
    assert not pygame.display.get_init()


def test_a_window_closed_by_the_user_stays_closed(pygame):
    window = Window("test")
    window.show(FRAME, 1000)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    assert not window.show(FRAME, 1000)
    assert window.closed
    assert not window.show(FRAME, 1000)
    assert not pygame.display.get_init()


def test_a_picture_of_another_size_is_fitted(pygame):
    window = Window("test")
    window.show(FRAME, 1000)
    window.show(np.zeros((120, 160, 3), np.uint8), 1000)
    assert pygame.display.get_surface().get_size() == (80, 60)
    window.close()


def test_close_before_anything_was_shown(pygame):
    Window("test").close()


def test_without_pygame_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(ImportError, match=r'pip install "\.\[render\]" in the checkout'):
        Window("test")


def test_without_a_screen_the_error_says_so(pygame, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "nonsense")
    with pytest.raises(RuntimeError, match="no screen for the window"):
        Window("test").show(FRAME, 10)
