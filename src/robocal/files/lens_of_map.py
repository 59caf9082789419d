"""The lens in map.yaml: with which numbers the images of a map were seen, and what their errors have in common with it."""

from __future__ import annotations

from pydantic import FiniteFloat

from robocal._types import Array
from robocal.files.schema import FileModel
from robocal.files.units import number
from robocal.files.yamlio import YamlDocument
from robocal.vision.camera import MODELS
from robocal.vision.maps import MapLens

__all__ = ["MapLensModel", "lens_lines", "lens_symbols", "split_lens"]


class MapLensModel(FileModel):
    """The lens of the images, in map.yaml."""

    model: str
    known: list[str]
    given: list[FiniteFloat]
    found: list[FiniteFloat]


def lens_symbols(document: YamlDocument, given: MapLensModel | None) -> tuple[str, ...]:
    """The symbols of the numbers that were free. Raises FormatError."""
    if given is None:
        return ()
    document.insist_known(given.model, tuple(MODELS), "no such model of lenses", ("lens", "model"))
    symbols = MODELS[given.model].symbols
    for key in ("given", "found"):
        count = len(getattr(given, key))
        expected = f"{len(symbols)}: {', '.join(symbols)}"
        document.insist(
            count == len(symbols), "a lens with other numbers", ("lens", key), found=count, expected=expected
        )
    for i, symbol in enumerate(given.known):
        document.insist_known(symbol, symbols, f"not a number of a {given.model} lens", ("lens", "known", i))
        document.insist(symbol not in given.known[:i], "a number stands twice", ("lens", "known", i), found=symbol)
    stated = isinstance(document.data.get("covariance"), str | list)
    document.insist(
        stated, "a lens, but no covariance that it is in", ("lens",), expected="as robocal vision map writes it"
    )
    return tuple(given.known)


def split_lens(whole: Array | None, given: MapLensModel, count: int) -> tuple[Array | None, MapLens | None]:
    """The covariance without the numbers of the lens, and what these share with the map."""
    if whole is None:
        return whole, None
    own, places = len(whole) - len(given.known), 6 * count
    beside, edges = whole[:own, own:], whole[places:own, own:] if own > places else None
    numbers = tuple(given.known), tuple(given.given), tuple(given.found)
    return whole[:own, :own], MapLens(given.model, *numbers, whole[own:, own:], beside[:places], edges)


def lens_lines(lens: MapLens | None) -> list[str]:
    """What map.yaml says of its lens."""
    if lens is None:
        return []
    given, found = (f"[{', '.join(map(number, numbers))}]" for numbers in (lens.before, lens.after))
    return [
        "lens:    # of the images: numbers that were free, all numbers as they were given, and as found",
        f"  model: {lens.model}", f"  known: [{', '.join(lens.known)}]", f"  given: {given}", f"  found: {found}",
    ]  # fmt: skip
