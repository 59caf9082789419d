"""Ways to damage the text of a valid file: letters, words, numbers, lines and columns, and what somebody hostile would write."""

from __future__ import annotations

import random
import re
import string
from collections.abc import Callable

import numpy as np

Damage = Callable[[random.Random, str], str]
WORDS = (
    "nan .nan inf -inf 0 -1 1e308 1e-308 999999999999999999999 true null ~ [] {} '' \"\" deg rad mm m cm inch khalil dh mdh poe "
    "elements fixed prismatic revolute position pose euler tool base j1 j2 j9 x 0x10 1_000 .5 5. "
    "1,5 - : # & * ! % @ | > \t \0 é \u2028 <robot/> ---"
).split(" ")
HOSTILE = (
    "\x1b[31mred", "a\x07b", "\\x1b[2J", '"\\e[31m"', '"a\\nb"', "&#10;b", "&#27;", "\u202eabc", "\x9b5m", "=cmd|' /C calc'!A0", "+SUM(1)",
    "-2+3+cmd", "@x", "x" * 20_000, "9" * 5_000, "[" * 200, "{" * 200, "{a: " * 40, "../../../../etc/passwd", "/etc/passwd", "/dev/zero",
    "file:///etc/passwd", "<!DOCTYPE a [<!ENTITY b 'c'>]>", "&b;", "<!--", "]]>", "a, " * 3_000, "1 " * 3_000, "\ud800", "\ufeff", "\r",
)  # fmt: skip


def drop(rng: random.Random, text: str) -> str:
    at = rng.randrange(len(text))
    return text[:at] + text[at + rng.choice((1, 1, 1, 3, 20)) :]


def insert(rng: random.Random, text: str) -> str:
    at = rng.randrange(len(text))
    return text[:at] + rng.choice((rng.choice(string.printable), rng.choice(WORDS))) + text[at:]


def other_character(rng: random.Random, text: str) -> str:
    at = rng.randrange(len(text))
    return text[:at] + rng.choice(string.printable) + text[at + 1 :]


def other_digit(rng: random.Random, text: str) -> str:
    places = [i for i, c in enumerate(text) if c.isdigit()]
    at = rng.choice(places)
    return text[:at] + rng.choice(string.digits) + text[at + 1 :]


def tokens(text: str) -> list[tuple[int, int]]:
    """Where words and numbers begin and end."""
    return [found.span() for found in re.finditer(r"[\w.+-]+", text)]


def other_word(rng: random.Random, text: str) -> str:
    a, b = rng.choice(tokens(text))
    return text[:a] + rng.choice(WORDS) + text[b:]


def other_number(rng: random.Random, text: str) -> str:
    numbers = [(a, b) for a, b in tokens(text) if is_number(text[a:b])]
    a, b = rng.choice(numbers)
    value = float(text[a:b])
    made = rng.choice(
        (-value, value * 1000, value / 1000, value * 57.29578, value + rng.gauss(0, 1), value * 25.4, 0.0, value * 1e9)
    )
    return text[:a] + repr(made) + text[b:]


def is_number(word: str) -> bool:
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False


def swap_words(rng: random.Random, text: str) -> str:
    (a, b), (c, d) = sorted(rng.sample(tokens(text), 2))
    return text[:a] + text[c:d] + text[b:c] + text[a:b] + text[d:]


def lines(rng: random.Random, text: str) -> str:
    rows = text.splitlines(keepends=True)
    i, j = rng.randrange(len(rows)), rng.randrange(len(rows))
    match rng.randrange(4):
        case 0:
            del rows[i]
        case 1:
            rows.insert(j, rows[i])
        case 2:
            rows[i], rows[j] = rows[j], rows[i]
        case _:
            rows[i] = rng.choice(("  ", "\t", "- ")) + rows[i]
    return "".join(rows)


def truncate(rng: random.Random, text: str) -> str:
    return text[: rng.randrange(len(text))]


def column(rng: random.Random, text: str) -> str:
    """A whole column of the table scaled, shifted, emptied or exchanged with another."""
    rows = [row.split(",") for row in text.splitlines()]
    width = min(len(row) for row in rows[1:])
    if width < 3:
        return truncate(rng, text)
    a, b, how = rng.randrange(width), rng.randrange(width), rng.randrange(4)
    factor = rng.choice((-1.0, 1e-3, 1e3, 10.0, 57.29578, 0.0174533, 1.02))
    for row in rows[2:] if how < 3 else rows[1:]:
        if how == 3:
            row[a], row[b] = row[b], row[a]
        elif is_number(row[a]):
            row[a] = repr(float(row[a]) * factor) if how == 0 else repr(float(row[a]) + factor) if how == 1 else row[b]
    return "\n".join([",".join(row) for row in rows]) + "\n"


def hostile(rng: random.Random, text: str) -> str:
    """What nobody writes by mistake, in place of a word or before it."""
    a, b = rng.choice(tokens(text))
    return text[:a] + rng.choice(HOSTILE) + text[rng.choice((a, b)) :]


def bloated(rng: random.Random, text: str) -> str:
    """A line again and again."""
    rows = text.splitlines(keepends=True)
    i = rng.randrange(len(rows))
    return "".join([*rows[:i], *[rows[i]] * 300, *rows[i:]])


SLIPS: tuple[Damage, ...] = (
    drop, insert, other_character, other_digit, other_digit, other_word, other_word,
    other_number, other_number, swap_words, lines, truncate,
)  # fmt: skip
ANY: tuple[Damage, ...] = (*SLIPS, column, hostile, hostile, hostile, bloated)


def damaged(rng: random.Random, text: str, ways: tuple[Damage, ...] = ANY) -> tuple[str, str]:
    """A text damaged once, sometimes twice: what was done, and what became of it."""
    done = []
    for _ in range(rng.choice((1, 1, 1, 2))):
        how = rng.choice(ways)
        try:
            text = how(rng, text)
        except (IndexError, ValueError):  # nothing left of the sort that this one damages
            continue
        done.append(how.__name__)
    return "+".join(done), text


# --- bytes ----------------------------------------------------------------------------------------------------------------

ODD = '1e160 -1e155 1e-320 1e400 nan -inf 1_5 \u2212 \u22125.5 -0 0x1F 1.2.3 1,2,3 ١٢ １２ 1’769.5 true null [] {} [[1]] "" 9e18'.split(
    " "
)
ENCODINGS = ("utf-16", "utf-16-le", "utf-32", "utf-8-sig", "cp1252", "cp500", "shift_jis", "utf-7")


def flip(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]


def cut_out(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + data[at + rng.choice((1, 2, 7, 60, 400)) :]


def cut_off(rng: random.Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data))]


def rows(rng: random.Random, data: bytes) -> bytes:
    """A line lost, doubled, or all of them in another order."""
    found = data.splitlines(keepends=True)
    i, j, how = rng.randrange(len(found)), rng.randrange(len(found)), rng.randrange(3)
    if how == 0:
        del found[i]
    elif how == 1:
        found.insert(j, found[i])
    else:
        rng.shuffle(found)
    return b"".join(found)


def columns(rng: random.Random, data: bytes) -> bytes:
    """Two cells of every line exchanged, or one of them gone."""
    sign = rng.choice([s for s in (b",", b";", b"\t") if s in data])
    table = [line.split(sign) for line in data.split(b"\n")]
    width = max(map(len, table))
    a, b = rng.randrange(width), rng.randrange(width)
    for line in table:
        if max(a, b) < len(line):
            line[a], line[b] = line[b], line[a]
    if rng.random() < 0.3:
        table = [line[:a] + line[a + 1 :] for line in table]
    return b"\n".join(map(sign.join, table))


def odd_number(rng: random.Random, data: bytes) -> bytes:
    found = rng.choice(list(re.finditer(rb"-?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?", data)))
    word = "" if rng.random() < 0.1 else rng.choice(ODD)
    return data[: found.start()] + word.encode() + data[found.end() :]


def odd_type(rng: random.Random, data: bytes) -> bytes:
    """A value of another type: a list for a number, a mapping for a word."""
    found = rng.choice(list(re.finditer(rb"[:,=] ?([^\s,;{}\[\]<>]+)", data)))
    made = rng.choice((b"[1, 2]", b"{a: 1}", b"null", b"true", b"[]", b'""', b"1.5", b"word", b"2026-03-01", b"[[[]]]"))
    return data[: found.start(1)] + made + data[found.end(1) :]


def deep(rng: random.Random, data: bytes) -> bytes:
    at, n = rng.randrange(len(data)), rng.choice((60, 3000))
    opened, closed = rng.choice(
        ((b"[", b"]"), (b"{a: ", b"}"), (b"<a>", b"</a>"), (b'{"a": ', b"}"), (b"(", b")"), (b"- ", b""))
    )
    return data[:at] + opened * n + (closed * n if rng.random() < 0.5 else b"") + data[at:]


def huge(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data))
    return (
        data[:at]
        + rng.choice((b"x", b"9", b" ", b'"', b"#", b"\xc3\xa9", b"0,")) * rng.choice((5_000, 140_000))
        + data[at:]
    )


def ends(rng: random.Random, data: bytes) -> bytes:
    """Other ends of lines."""
    made = rng.choice((b"\r\n", b"\r", b"\n\n", b"\x85", b"\xe2\x80\xa8", b"\r\r\n"))
    return data.replace(b"\n", made, -1 if rng.random() < 0.7 else 3)


def zeros(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + b"\0" * rng.choice((1, 1, 500)) + (data[at:] if rng.random() < 0.7 else b"")


def encoded(rng: random.Random, data: bytes) -> bytes:
    return data.decode("utf-8", "replace").encode(rng.choice(ENCODINGS), "replace")


def words(rng: random.Random, data: bytes) -> bytes:
    """What `damaged` does to texts."""
    return damaged(rng, data.decode("utf-8", "surrogateescape"))[1].encode("utf-8", "surrogatepass")


BYTES: tuple[Callable[[random.Random, bytes], bytes], ...] = (
    flip, cut_out, cut_off, rows, columns, odd_number, odd_number, odd_type, deep, huge, ends, zeros, encoded, words, words,
)  # fmt: skip


def damaged_bytes(rng: random.Random, data: bytes) -> tuple[str, bytes]:
    """A file damaged once, sometimes more often: what was done, and what became of it."""
    done = []
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        how = rng.choice(BYTES)
        try:
            data = how(rng, data)
        except (IndexError, ValueError):
            continue
        done.append(how.__name__)
    return "+".join(done), data


def misspelt(rng: random.Random, text: str) -> tuple[str, str]:
    """A key of a YAML file with one letter changed: the wrong word, and the text."""
    found = rng.choice(list(re.finditer(r"(?m)(?:^|[{,] ?|- )([a-z_]{4,})(?=: )", text)))
    word = found[1]
    at = rng.randrange(len(word))
    wrong = word[:at] + rng.choice([c for c in "qxzw" if c != word[at]]) + word[at + 1 :]
    return wrong, text[: found.start(1)] + wrong + text[found.end(1) :]
