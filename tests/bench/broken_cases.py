"""Cases that fail, hang and die, for the tests of the watchdog."""

import os
import time


def fails():
    return "2 of 3", False


def raises():
    raise ArithmeticError("the volume is\nnot what it was")


def hangs():
    time.sleep(60.0)
    return "woke up", True


def dies():
    os._exit(9)


def passes():
    return "all", True
