"""A window on a screen that shows pictures as they come. Needs pygame-ce."""

from os import environ
from time import monotonic, sleep
from types import ModuleType

import numpy as np


class Window:
    """Shows one picture after the other. Once the user has closed it, it stays closed and `show` does nothing."""

    def __init__(self, title: str):
        self._pygame = _pygame()
        self.title = title
        self.closed = False
        self._screen = None
        self._due = 0.0

    def show(self, frame: np.ndarray, fps: float) -> bool:
        """Show `frame` uint8 (h, w, 3), `fps` pictures a second at most; returns whether the window is still open."""
        if self.closed:
            return False
        self._open(frame.shape[1], frame.shape[0])
        if any(event.type == self._pygame.QUIT for event in self._pygame.event.get()):
            self.close()
            return False
        self._draw(frame)
        self._wait(fps)
        return True

    def close(self) -> None:
        """Close the window; again is no error."""
        if self._screen is not None:
            self._screen = None
            self._pygame.display.quit()
        self.closed = True

    def _open(self, width: int, height: int) -> None:
        if self._screen is not None:
            return
        try:
            self._pygame.display.init()
            self._screen = self._pygame.display.set_mode((width, height), self._pygame.RESIZABLE)
        except self._pygame.error as error:
            message = f"no screen for the window ({error}); render_mode rgb_array needs none"
            raise RuntimeError(message) from error
        self._pygame.display.set_caption(self.title)

    def _draw(self, frame: np.ndarray) -> None:
        """Lay the picture into the window, as large as fits, its sides in proportion."""
        surface = self._pygame.image.frombuffer(np.ascontiguousarray(frame).tobytes(), frame.shape[1::-1], "RGB")
        screen = self._pygame.display.get_surface()
        grow = min(screen.get_width() / frame.shape[1], screen.get_height() / frame.shape[0])
        if grow != 1:
            size = max(1, round(frame.shape[1] * grow)), max(1, round(frame.shape[0] * grow))
            surface = self._pygame.transform.smoothscale(surface, size)
        screen.fill((30, 35, 42))
        screen.blit(surface, ((screen.get_width() - surface.get_width()) // 2, 0))
        self._pygame.display.flip()

    def _wait(self, fps: float) -> None:
        """Sleep until the next picture is due."""
        now = monotonic()
        self._due = max(self._due + 1 / fps, now)
        sleep(min(self._due - now, 1 / fps))


def _pygame() -> ModuleType:
    environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        import pygame
    except ImportError as error:
        raise ImportError('the window needs pygame-ce: pip install ".[render]" in the checkout') from error
    return pygame
