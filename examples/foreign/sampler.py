"""A cosine-weighted hemisphere in plain Python, for `warpcheck check --sampler "python3 sampler.py"`.

--broken leaves out the square root, as is easily done. The protocol is in docs/protocol.md.
"""
import math, struct, sys

BROKEN = "--broken" in sys.argv[1:]


def sample(u, v):
    r, phi = (u if BROKEN else math.sqrt(u)), 2 * math.pi * v
    return r * math.cos(phi), r * math.sin(phi), math.sqrt(max(0.0, 1 - r * r))


def pdf(x, y, z):  # per solid angle
    return max(0.0, z) / math.pi


print("warpcheck 1 domain=hemisphere dimensions=2", flush=True)
width = {b"sample": 2, b"density": 3}  # numbers in a row of each question
while line := sys.stdin.buffer.readline():
    word, count = line.split()
    row = struct.Struct("<%dd" % width[word])
    answer = []
    for numbers in row.iter_unpack(sys.stdin.buffer.read(row.size * int(count))):
        if word == b"sample":
            point = sample(*numbers)
            answer += *point, pdf(*point)
        else:
            answer.append(pdf(*numbers))
    sys.stdout.buffer.write(struct.pack("<%dd" % len(answer), *answer))
    sys.stdout.buffer.flush()
