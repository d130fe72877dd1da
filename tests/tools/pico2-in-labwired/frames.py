"""Frames of the serial port: docs/serial.md."""

import binascii


def request(sequence, body):
    frame = bytes([1, 1]) + sequence.to_bytes(4, "little") + body
    frame += crc32c(frame).to_bytes(4, "little")
    return b"\0" + b"".join(bytes([len(run) + 1]) + run for run in frame.split(b"\0")) + b"\0"


def answers(wire):
    """The bodies of all frames, by their sequence numbers."""
    frames = [unstuffed(part) for part in wire.split(b"\0") if part]
    for frame in frames:
        if crc32c(frame[:-4]) != int.from_bytes(frame[-4:], "little") or frame[:2] != bytes([1, 2]):
            raise ValueError(f"no answer: {binascii.hexlify(frame).decode()}")
    return {int.from_bytes(frame[2:6], "little"): frame[6:-4] for frame in frames}


def unstuffed(part):
    frame = bytearray()
    while part:
        code = part[0]
        frame += part[1:code]
        part = part[code:]
        if code < 255 and part:
            frame.append(0)
    return bytes(frame)


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF
