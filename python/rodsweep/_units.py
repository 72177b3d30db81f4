"""Quantities of pint and astropy as numbers in SI units, and doubts about bare numbers."""

from __future__ import annotations

import math
import os
import sys
import warnings
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ._errors import InputError, UnitWarning
from ._rodsweep import quantity

if TYPE_CHECKING:
    from .scene import Scene

_BARE = frozenset({float, int, str, bool, np.float64, type(None)})
_BASES = {
    "[length]": ("meter", "m"),
    "[mass]": ("kilogram", "kg"),
    "[time]": ("second", "s"),
    "[current]": ("ampere", "A"),
}
_HINT = 'give a quantity of pint or astropy, a text with a unit such as "90 mm", or a number in SI units'


def kind_of(value: Any) -> str | None:
    """``pint``, ``astropy``, ``xarray``; ``other`` for units of another package; None for what carries no unit."""
    if type(value) in _BARE or type(value) is np.ndarray or isinstance(value, (Mapping, list, tuple)):
        return None
    if hasattr(value, "attrs") and hasattr(value, "dims") and hasattr(value, "data"):
        return "xarray" if kind_of(value.data) or any(key in value.attrs for key in ("units", "unit")) else None
    if hasattr(value, "magnitude") and hasattr(value, "dimensionality") and callable(getattr(value, "to", None)):
        return "pint"
    if hasattr(value, "unit") and hasattr(value, "value") and callable(getattr(value, "to", None)):
        return "astropy"
    if hasattr(getattr(value, "dtype", None), "units"):
        return "other"
    # A label of a series or a frame is no unit.
    if not hasattr(value, "iloc") and (hasattr(value, "units") or hasattr(value, "unit")):
        return "other"
    return None


def is_bare(value: Any) -> bool:
    """Whether it is a number, or numbers, and nothing says their unit."""
    if isinstance(value, str):
        return False
    if type(value) is np.ndarray and value.dtype.kind != "O":
        return True
    if isinstance(value, (list, tuple)) or (type(value) is np.ndarray and value.ndim):
        return all(type(item) in (float, int) or is_bare(item) for item in value)
    return kind_of(value) is None


def si(name: str, value: Any, unit: str | None) -> Any:
    """The same value with each quantity, and each text in a list, as a number in an SI unit.

    A unit of None: the components of the parameter have several.
    """
    if type(value) in _BARE or (type(value) is np.ndarray and value.dtype.kind not in "OU"):
        return value
    if isinstance(value, (list, tuple)) or (type(value) is np.ndarray and value.ndim):
        if is_bare(value):
            return value
        return [_listed(name, item, unit) if isinstance(item, str) else si(name, item, unit) for item in value]
    kind = kind_of(value)
    if kind is None:
        return value
    if unit is None:
        raise InputError(f"`{name}`: its components have different units; give each by its own name", name)
    if kind == "xarray":
        if kind_of(value.data):
            return si(name, value.data, unit)
        words = value.attrs.get("units", value.attrs.get("unit"))
        return np.asarray(value.data) * _text(name, f"1 {words}", unit) if words else np.asarray(value.data)
    if kind == "other":
        raise _foreign(name, value)
    return _in(name, value, unit, kind)


def number(key: str, value: Any, unit: str) -> float:
    """One number: of a number, of a text with a unit, or of a quantity."""
    if isinstance(value, str):
        return quantity(key, value, unit)
    converted = si(key, value, unit)
    try:
        return float(converted)
    except (TypeError, ValueError, OverflowError):
        example = 'give a number in metres or a text such as "8 mm"' if unit == "m" else "give a number"
        raise InputError(f"`{key}`: is {value!r}; {example}", key) from None


def as_text(key: str, value: Any) -> Any:
    """A quantity as a text, or lists of texts, for the library's own reader, which knows the dimension of each key."""
    kind = kind_of(value)
    if kind == "xarray":
        if kind_of(value.data):
            return as_text(key, value.data)
        words = value.attrs.get("units", value.attrs.get("unit"))
        return _texts(key, np.asarray(value.data).tolist(), str(words))
    if kind == "pint":
        numbers, unit = _pint_base(key, value)
    elif kind == "astropy":
        numbers, unit = _astropy_base(key, value)
    else:
        raise _foreign(key, value)
    return _texts(key, np.asarray(numbers).tolist(), unit)


def _texts(key: str, numbers: Any, unit: str) -> Any:
    if isinstance(numbers, list):
        return [_texts(key, item, unit) for item in numbers]
    if not math.isfinite(numbers):
        raise InputError(f"`{key}`: is {numbers}; give a finite number", key)
    return f"{float(numbers)!r} {unit}"


def _text(name: str, text: str, unit: str | None) -> float:
    if unit is None:
        raise InputError(f"`{name}`: its components have different units; give each by its own name", name)
    return quantity(name, text, unit)


def _listed(name: str, text: str, unit: str | None) -> float:
    """A text in a list: one that looks like a number has been read from somewhere, in an unknown unit."""
    try:
        float(text)
    except ValueError:
        return _text(name, text, unit)
    raise InputError(f"`{name}`: holds the text {text!r}; give a number, or a text with a unit", name)


def _foreign(name: str, value: Any) -> InputError:
    where = f"{type(value).__module__}.{type(value).__qualname__}".removeprefix("builtins.")
    return InputError(f"`{name}`: carries units of {where}, which are not known here; {_HINT}", name)


def _in(name: str, value: Any, unit: str, kind: str) -> Any:
    """A quantity in an SI unit as the library writes it, such as ``N·m²``."""
    plain = unit.replace("·", "*").replace("²", "**2").replace("³", "**3").replace("⁴", "**4")
    wanted = [plain or ("dimensionless" if kind == "pint" else "")]
    if unit == "1/m":
        wanted.append("rad/m")
    if unit == "T" and kind == "pint":
        # Gauss has a dimension of its own there.
        wanted.append("Gaussian")
    for text in wanted:
        try:
            converted = value.to("T", "Gaussian") if text == "Gaussian" else value.to(text)
        except Exception:  # each package has its own
            continue
        return converted.magnitude if kind == "pint" else converted.value
    given = value.units if kind == "pint" else value.unit
    raise InputError(f"`{name}`: is in {given or 'no unit'}; give a quantity in {unit or 'no unit'}", name)


def _pint_base(key: str, value: Any) -> tuple[Any, str]:
    dimensions = dict(value.dimensionality)
    if not dimensions:
        is_angle = any(word in str(value.units) for word in ("rad", "deg", "turn", "rev", "arc"))
        return (value.to("radian").magnitude, "rad") if is_angle else (value.to("dimensionless").magnitude, "m/m")
    if any(power != int(power) for power in dimensions.values()):
        return _in(key, value, "T", "pint"), "T"
    if not set(dimensions) <= set(_BASES):
        raise InputError(f"`{key}`: is in {value.units}, which no number of a scene is in", key)
    product = "*".join(f"{_BASES[name][0]}**{int(power)}" for name, power in dimensions.items())
    return value.to(product).magnitude, "·".join(
        f"{_BASES[name][1]}^{int(power)}" for name, power in dimensions.items()
    )


def _astropy_base(key: str, value: Any) -> tuple[Any, str]:
    base = value.decompose()
    powers = {str(unit): power for unit, power in zip(base.unit.bases, base.unit.powers, strict=True)}
    if not powers:
        return base.value * base.unit.scale, "m/m"
    if not set(powers) <= {"m", "kg", "s", "A", "rad"} or any(power != int(power) for power in powers.values()):
        raise InputError(f"`{key}`: is in {value.unit}, which no number of a scene is in", key)
    return base.value * base.unit.scale, "·".join(f"{unit}^{int(power)}" for unit, power in powers.items())


# Bare numbers out of proportion.

# A bare number beyond this share of the scene's own is worth a word.
_OUT_OF_PROPORTION = 100.0
# What passes through zero, such as a current, may well begin small in the scene.
_OUT_OF_PROPORTION_SIGNED = 500.0
_TWO_TURNS = 4 * math.pi * (1 + 1e-9)
_NEVER_NEGATIVE = ("m²", "Pa", "N·m²", "kg", "kg/m", "kg/m³")
# Those that are often given in megapascals or grams per cubic centimetre.
_OFTEN_TOO_SMALL = ("Pa", "kg/m³")
_WORDS = {
    "m": "metres",
    "m²": "square metres",
    "rad": "radians",
    "A": "amperes",
    "N": "newtons",
    "T": "teslas",
    "Pa": "pascals",
    "kg": "kilograms",
    "kg/m³": "kilograms per cubic metre",
}


def doubt(scene: Scene, name: str, numbers: Any) -> None:
    """Warns where bare numbers of a parameter are out of proportion to the scene's own."""
    try:
        array = np.asarray(numbers, dtype=np.float64)
        names = scene.components(name)
    except (InputError, TypeError, ValueError, OverflowError):
        # Whoever reads them says it.
        return
    if not array.size:
        return
    with np.errstate(invalid="ignore"):
        most = float(np.nanmax(np.abs(array))) if not np.isnan(array).all() else math.nan
    if not 0 < most < math.inf:
        return
    known = scene._known()
    components = [component for component in names if component in known]
    units = {known[component][0] for component in components}
    if len(units) != 1:
        return
    unit = units.pop()
    own = max(abs(known[component][1]) for component in components)
    if unit == "rad":
        if most > _TWO_TURNS:
            _warn(f"`{name}` is {most:g} rad, {_rounded(most / (2 * math.pi))} turns; radians?")
        return
    if unit == "m" and ".position." in f".{components[0]}.":
        own = max(own, scene.length)
    elif unit == "m":
        own = own or scene.length
    elif unit not in _NEVER_NEGATIVE:
        siblings = components[0].rpartition(".")[0] + "."
        own = max([own, *(abs(value) for other, (_, value) in known.items() if other.startswith(siblings))])
    if not own or not unit:
        return
    limit = _OUT_OF_PROPORTION if unit == "m" or unit in _NEVER_NEGATIVE else _OUT_OF_PROPORTION_SIGNED
    if most >= limit * own:
        _warn(f"`{name}` is {most:g} {unit}, {_rounded(most / own)} times the scene's; {_asked(unit)}")
    elif unit in _OFTEN_TOO_SMALL and most * _OUT_OF_PROPORTION <= own:
        _warn(f"`{name}` is {most:g} {unit}, 1/{_rounded(own / most)} of the scene's; {_asked(unit)}")


def doubt_length(scene: Scene, key: str, value: Any, share: float = _OUT_OF_PROPORTION) -> None:
    """Warns where a bare length, or a place, is more than a share of the rod's length."""
    if value is None or not is_bare(value):
        return
    try:
        array = np.abs(np.asarray(value, dtype=np.float64))
    except (TypeError, ValueError):
        return
    if not array.ndim and not float(value) > 0:
        # Refused, or asks for nothing.
        return
    array = array[np.isfinite(array)]
    if array.size and scene.length > 0 and array.max() >= share * scene.length:
        most = float(array.max())
        _warn(f"`{key}` is {most:g} m, {_rounded(most / scene.length)} times the rod's length; metres?")


def doubt_tables(tables: Mapping[str, Any]) -> None:
    """Warns about bare numbers of a dictionary that no rod has."""
    base = tables.get("base")
    if isinstance(base, Mapping):
        _doubt_angle("base.rotation", base.get("rotation"))
    segments = tables.get("segment")
    for at, segment in enumerate(segments if isinstance(segments, (list, tuple)) else ()):
        if not isinstance(segment, Mapping):
            continue
        for key, low, high, unit in (
            ("length", 0.0, 20.0, "m"),
            ("youngs_modulus", 100.0, math.inf, "Pa"),
            ("shear_modulus", 30.0, math.inf, "Pa"),
        ):
            value = segment.get(key)
            if isinstance(value, (int, float)) and not isinstance(value, bool) and 0 < value < math.inf:
                if not low <= value <= high:
                    _warn(f"`segment[{at}].{key}` is {value:g} {unit}; {_asked(unit)}")
        if isinstance(segment.get("coil"), Mapping):
            _doubt_angle(f"segment[{at}].coil.alignment", segment["coil"].get("alignment"))


def _doubt_angle(key: str, value: Any) -> None:
    listed = [item for item in value if type(item) in (int, float)] if isinstance(value, (list, tuple)) else []
    if listed and max(map(abs, listed)) > _TWO_TURNS:
        _warn(f"`{key}` holds {max(listed, key=abs):g} rad; radians?")


def _asked(unit: str) -> str:
    return f"{_WORDS[unit]}?" if unit in _WORDS else f"in {unit}?"


def _rounded(factor: float) -> str:
    """Two digits of a number."""
    return f"{float(f'{factor:.2g}'):,.0f}" if factor < 1e9 else f"{factor:.1e}"


def _warn(text: str) -> None:
    """Where the user called."""
    own, level = os.path.dirname(__file__), 1
    frame = sys._getframe()
    while frame is not None and os.path.dirname(frame.f_code.co_filename) == own and frame.f_back is not None:
        frame, level = frame.f_back, level + 1
    warnings.warn(text + " A text with a unit tells it, and no warning comes.", UnitWarning, stacklevel=level)


def doubt_axes(scene: Scene, blocks: Iterable[Any]) -> None:
    """Warns about bare numbers of the axes of a sweep."""
    for block in blocks:
        if not isinstance(block, Mapping):
            continue
        names = block.get("parameters", block.get("parameter"))
        bare: list[float] = []
        for key in ("from", "to", "mean", "mode", "values"):
            value = block.get(key)
            if value is not None and is_bare(value):
                bare += np.atleast_1d(np.asarray(value)).ravel().tolist()
        for name in [names] if isinstance(names, str) else names if isinstance(names, (list, tuple)) else ():
            doubt(scene, name, bare)
