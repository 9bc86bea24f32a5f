# SPDX-License-Identifier: Apache-2.0
"""How far pictures are apart."""
import math


def difference(a, b):
    """Root mean square of a colour in steps of 8 bits, of two of rgba8, over the pixels that are not background in both."""
    total = count = 0
    for i in range(0, len(a), 4):
        if a[i:i + 3] == b[i:i + 3] == bytes(3):
            continue
        total += sum((a[i + c] - b[i + c]) ** 2 for c in range(3))
        count += 3
    return math.sqrt(total / count) if count else 0.0


def holes(picture, complete):
    """Pixels of rgba8 that are background where the complete picture is not."""
    return sum(picture[i:i + 3] == bytes(3) != complete[i:i + 3] for i in range(0, len(picture), 4))
