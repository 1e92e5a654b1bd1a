"""Checks of what people and files give us: each returns the value, or raises a ValueError of one
line.

`where` begins the line: the file, the place in it and the field, as in `box.json:
crayons[2].hiding`.
No numpy here: the command line checks its words without waiting for it.
"""

import difflib
import json
import numbers
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

_SHOWN = 12  # names listed when none is near

T = TypeVar("T")
Object = dict[str, Any]


def number(value: Any, low: float, high: float, where: str, unit: str = "") -> float:
    """A finite number, Python's or numpy's and no bool, from low to high.

    >>> number(3, 0, 5, "box.json: film_um")
    3.0
    """
    if not is_number(value) or not low <= value <= high:
        unit = unit and f" {unit}"
        raise ValueError(f"{where}: {shown(value)} is not a number from {low:g} to {high:g}{unit}")
    return float(value)


def is_number(value: Any) -> bool:
    """Whether a value is a finite number, Python's or numpy's, and no bool."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return False
    return bool(-1e300 < value < 1e300)  # type: ignore[operator]  # Real has no order in typeshed


def whole(value: Any, low: int, high: int, where: str, most: str = "") -> int:
    """A whole number, Python's or numpy's, from low to high; most: how to write `high` in the
    message.
    """
    right = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    if not right or not low <= int(value) <= high:
        raise ValueError(
            f"{where}: {shown(value)} is not a whole number from {low} to {most or high}"
        )
    return int(value)


def text(value: Any, longest: int, where: str, shortest: int = 0) -> str:
    """One line of printable text."""
    if not isinstance(value, str) or not value.isprintable() \
            or not shortest <= len(value) <= longest:  # fmt: skip
        length = f"{shortest} to {longest}" if shortest else f"at most {longest}"
        raise ValueError(f"{where}: {shown(value)} is not text of {length} printable characters")
    return value


def of_kind(kind: type[T], value: Any, where: str, right: str) -> T:
    """A value of a type; right: what would be one, in words."""
    if isinstance(value, kind):
        return value
    raise ValueError(f"{where}: {shown(value)} is not {right}")


def keys(data: Iterable[str], valid: Sequence[str], where: str) -> None:
    """All keys of an object must be among the valid ones."""
    for key in data:
        if key not in valid:
            raise ValueError(
                f"{where}: unknown key {quoted(str(key))}{did_you_mean(str(key), valid)}"
            )


def count(what: str, number_of: int, most: int, where: str) -> None:
    """No more than `most` of something."""
    if number_of > most:
        raise ValueError(f"{where}: {number_of:,} {what}, at most {most:,} are taken")


# ---- JSON ----------------------------------------------------------------------------------------


class _RepeatedKey(ValueError):
    """The same key twice in one JSON object."""


def parsed_json(
    content: str, where: str, what: str, packed: Callable[[Object], Object] = lambda one: one
) -> Any:
    """JSON text as Python values, no key twice in one object.

    what: the thing described, for messages.   packed: is given each object and may shrink it.
    """

    def made(pairs: list[tuple[str, Any]]) -> Object:
        one = dict(pairs)
        if len(one) < len(pairs):
            names = [key for key, _ in pairs]
            twice = next(name for name in names if names.count(name) > 1)
            raise _RepeatedKey(f"the key {quoted(twice)} stands twice in one object")
        return packed(one)

    try:
        return json.loads(content, object_pairs_hook=made)
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise ValueError(f"{where}: {place}: not JSON ({error.msg})") from error
    except RecursionError as error:
        raise ValueError(f"{where}: nested too deeply to be a {what}") from error
    except _RepeatedKey as error:
        raise ValueError(f"{where}: {error}") from error
    except ValueError as error:
        raise ValueError(f"{where}: a whole number with thousands of digits") from error


# ---- words of a message --------------------------------------------------------------------------


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The nearest valid names; if none is near, all valid ones.

    >>> did_you_mean("palete", ["palette", "paper"])
    ' (did you mean "palette"?)'
    """
    valid = list(known)
    near = difflib.get_close_matches(name[:60].lower(), valid, n=3)
    if near:
        return f" (did you mean {' or '.join(quoted(n) for n in near)}?)"
    more = ", ..." if len(valid) > _SHOWN else ""
    return f" (valid: {', '.join(valid[:_SHOWN])}{more})"


def shown(value: Any) -> str:
    """A wrong value as a reader of the message would write it: short, printable, on one line."""
    if isinstance(value, str):
        return quoted(value)
    if isinstance(value, int) and abs(value) > 10**15:
        return "a huge number"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    kinds = {dict: "an object", type(None): "nothing"}
    return kinds.get(type(value)) or str(value).lower()


def quoted(content: str, limit: int = 60) -> str:
    """The text in double quotes, printable, on one line and cut to about `limit` characters."""
    cut = content if len(content) <= limit else content[: limit - 3] + "..."
    return f'"{printable(cut)}"'


def printable(content: str) -> str:
    """The text itself, or with its line ends, control characters and stray bytes as escapes."""
    return content if content.isprintable() else repr(content)[1:-1]
