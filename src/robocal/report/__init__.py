"""report.html: one self-contained page that a metrologist can hand over, and a picture for elsewhere. Only `files`
writes them."""

from robocal.report.page import render
from robocal.report.pictures import before_after

__all__ = ["before_after", "render"]
