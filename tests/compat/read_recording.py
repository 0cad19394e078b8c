#!/usr/bin/env python3
"""Reads a recording with the public mcap packages and prints what it found as JSON.

    read_recording.py REC.mcap
"""
import hashlib
import json
import sys

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def stamp_ns(message):
    return message.timestamp.seconds * 1_000_000_000 + message.timestamp.nanos


def content(message):
    """What a message says, in a form that the test can compare."""
    kind = message.DESCRIPTOR.full_name
    if kind == "foxglove.CompressedImage":
        return {"format": message.format, "sha256": hashlib.sha256(message.data).hexdigest()}
    if kind == "foxglove.RawImage":
        values = np.frombuffer(message.data, "<f4" if message.encoding == "32FC1" else "u1")
        return {"size": [message.width, message.height], "encoding": message.encoding, "sum": float(values.astype(float).sum())}
    if kind == "foxglove.CameraCalibration":
        return {"size": [message.width, message.height], "K": list(message.K), "P": list(message.P), "D": list(message.D)}
    if kind == "foxglove.PoseInFrame":
        p, q = message.pose.position, message.pose.orientation
        return {"frame_id": message.frame_id, "pose": [p.x, p.y, p.z, q.x, q.y, q.z, q.w]}
    if kind == "foxglove.PointCloud":
        types = {5: "<u4", 7: "<f4"}
        layout = np.dtype({"names": [f.name for f in message.fields], "formats": [types[f.type] for f in message.fields],
                           "offsets": [f.offset for f in message.fields], "itemsize": message.point_stride})
        points = np.frombuffer(message.data, layout)
        return {name: points[name].tolist() for name in ("id", "x", "y", "z")}
    return {"count": message.count, "bytes": len(message.surfels)}


def main(path):
    topics = {}
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        statistics = reader.get_summary().statistics
        for schema, channel, raw, message in reader.iter_decoded_messages():
            assert stamp_ns(message) == raw.log_time, (channel.topic, raw.log_time)
            topic = topics.setdefault(channel.topic, {"schema": schema.name, "stamps": [], "first": content(message)})
            topic["stamps"].append(raw.log_time)
    with open(path, "rb") as file:
        attachments = {a.name: hashlib.sha256(a.data).hexdigest() for a in make_reader(file, validate_crcs=True).iter_attachments()}
    with open(path, "rb") as file:
        metadata = {m.name: dict(m.metadata) for m in make_reader(file).iter_metadata()}
    json.dump({"topics": topics, "attachments": attachments, "metadata": metadata,
               "messages": statistics.message_count, "chunks": statistics.chunk_count}, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1])
