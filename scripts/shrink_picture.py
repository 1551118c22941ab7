#!/usr/bin/env python3
"""Reduces a PNG to at most 60 KB: scaled down by a whole number, with a palette.

    python3 scripts/shrink_picture.py IN.png OUT.png

For the pictures of the book. Reads 8 or 16 bits per channel, grey, RGB or RGBA, not interlaced.
Needs nothing but Python.
"""

import struct
import sys
import zlib

WIDTH = 900
MOST_BYTES = 60_000
CHANNELS = {0: 1, 2: 3, 4: 2, 6: 4}


def decode(data):
    """Width, height and a list of rows of (r, g, b)."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n", "not a PNG"
    at, packed = 8, b""
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, color, _, _, interlaced = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    assert depth in (8, 16) and color in CHANNELS and not interlaced, "unsupported PNG"
    raw, size = zlib.decompress(packed), depth // 8
    step = CHANNELS[color] * size
    stride = width * step
    rows, before = [], bytearray(stride)
    for y in range(height):
        start = y * (stride + 1)
        row = unfilter(raw[start], bytearray(raw[start + 1 : start + 1 + stride]), before, step)
        before = row
        planes = [row[k * size :: step] for k in range(CHANNELS[color])]
        r, g, b = planes[:3] if color in (2, 6) else (planes[0],) * 3
        rows.append(list(zip(r, g, b)))
    return width, height, rows


def unfilter(kind, row, before, step):
    if kind == 1:
        for i in range(step, len(row)):
            row[i] = (row[i] + row[i - step]) & 255
    elif kind == 2:
        row = bytearray((a + b) & 255 for a, b in zip(row, before))
    elif kind == 3:
        for i in range(len(row)):
            left = row[i - step] if i >= step else 0
            row[i] = (row[i] + (left + before[i]) // 2) & 255
    elif kind == 4:
        for i in range(len(row)):
            left, corner = (row[i - step], before[i - step]) if i >= step else (0, 0)
            above = before[i]
            guess = left + above - corner
            a, b, c = abs(guess - left), abs(guess - above), abs(guess - corner)
            nearest = left if a <= b and a <= c else above if b <= c else corner
            row[i] = (row[i] + nearest) & 255
    return row


def scaled(width, height, rows):
    factor = -(-width // WIDTH)
    if factor == 1:
        return width, height, rows
    width, height = width // factor, height // factor
    count = factor * factor
    result = []
    for y in range(height):
        block = rows[y * factor : (y + 1) * factor]
        line = []
        for x in range(width):
            cell = [p for row in block for p in row[x * factor : (x + 1) * factor]]
            line.append(tuple(sum(channel) // count for channel in zip(*cell)))
        result.append(line)
    return width, height, result


def palette(rows, size):
    """Median cut: at most `size` colours, and the index of each colour that occurs."""
    counts = {}
    for row in rows:
        for p in row:
            counts[p] = counts.get(p, 0) + 1
    boxes = [list(counts)]
    while len(boxes) < size:
        boxes.sort(key=lambda box: spread(box)[0] * len(box))
        box = boxes.pop()
        extent, axis = spread(box)
        if extent == 0:
            boxes.append(box)
            break
        box.sort(key=lambda p: p[axis])
        boxes += [box[: len(box) // 2], box[len(box) // 2 :]]
    colors, index = [], {}
    for k, box in enumerate(boxes):
        weight = sum(counts[p] for p in box)
        mean = [sum(p[c] * counts[p] for p in box) // weight for c in range(3)]
        colors.append(mean)
        index.update((p, k) for p in box)
    return colors, index


def spread(box):
    extents = [max(p[c] for p in box) - min(p[c] for p in box) for c in range(3)]
    axis = extents.index(max(extents))
    return extents[axis], axis


def encode(width, height, rows, size):
    colors, index = palette(rows, size)
    raw = b"".join(b"\0" + bytes(index[p] for p in row) for row in rows)

    def chunk(kind, body):
        check = zlib.crc32(kind + body)
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", check)

    header = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    table = bytes(channel for color in colors for channel in color)
    parts = [(b"IHDR", header), (b"PLTE", table), (b"IDAT", zlib.compress(raw, 9)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*part) for part in parts)


def main():
    source, target = sys.argv[1:]
    with open(source, "rb") as file:
        picture = scaled(*decode(file.read()))
    for size in (256, 192, 128, 96, 64, 48, 32, 24, 16):
        data = encode(*picture, size)
        if len(data) <= MOST_BYTES:
            break
    with open(target, "wb") as file:
        file.write(data)


main()
