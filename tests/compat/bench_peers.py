#!/usr/bin/env python3
"""What rerun and Foxglove take to show a cloud that moves in every frame, beside `cargo run --bin stream`.

    bench_peers.py [--points 100000] [--rate 30] [--seconds 10] [--out FILE.json]

Each resends the whole cloud: 16 bytes a point (x, y, z as f32, colour as u32). Loopback only; one producer, one
subscriber that drops what it gets. Prints bytes a frame and the producer's CPU time a frame; needs `pip install -r
requirements-bench.txt`.
"""
import argparse
import asyncio
import json
import multiprocessing
import os
import shutil
import socket
import struct
import subprocess
import tempfile
import time

import numpy as np
import psutil


def cloud(points):
    rng = np.random.default_rng(0)
    array = np.zeros(points, dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgba", "<u4")])
    for axis in "xyz":
        array[axis] = rng.normal(size=points)
    array["rgba"] = rng.integers(0, 1 << 32, points, dtype=np.uint32)
    return array


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def paced(seconds, rate, step):
    """Runs `step` at a rate; frames, CPU milliseconds of this process a frame, and the rate that was reached."""
    process = psutil.Process()
    cpu = sum(process.cpu_times()[:2])
    begin, frames = time.perf_counter(), 0
    while time.perf_counter() - begin < seconds:
        wait = begin + frames / rate - time.perf_counter()
        if wait > 0:
            time.sleep(wait)
        step(frames)
        frames += 1
    took = time.perf_counter() - begin
    cpu_ms = (sum(process.cpu_times()[:2]) - cpu) / frames * 1e3
    return frames, cpu_ms, frames / took


def foxglove_subscriber(port, results):
    import websockets

    async def listen():
        url = f"ws://127.0.0.1:{port}"
        sizes, latencies = [], []
        async with websockets.connect(url, subprotocols=["foxglove.sdk.v1"], max_size=None, compression=None) as socket:
            while True:
                try:
                    message = await asyncio.wait_for(socket.recv(), 4)
                except (asyncio.TimeoutError, websockets.ConnectionClosed):
                    break
                if isinstance(message, str):
                    told = json.loads(message)
                    if told.get("op") == "advertise":
                        wanted = [{"id": 1, "channelId": told["channels"][0]["id"]}]
                        await socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
                elif message[0] == 1:
                    sizes.append(len(message))
                    latencies.append((time.time_ns() - struct.unpack("<Q", message[5:13])[0]) / 1e6)
        results.put((float(np.mean(sizes)), float(np.percentile(latencies, 95))))

    asyncio.run(listen())


def foxglove(points, rate, seconds):
    import foxglove
    from foxglove.channels import PointCloudChannel
    from foxglove.messages import PackedElementField, PackedElementFieldNumericType, PointCloud, Pose, Quaternion, Vector3

    foxglove.set_log_level("ERROR")
    port = free_port()
    server = foxglove.start_server(host="127.0.0.1", port=port)
    channel = PointCloudChannel("/surfels")
    results = multiprocessing.get_context("spawn").Queue()
    subscriber = multiprocessing.get_context("spawn").Process(target=foxglove_subscriber, args=(port, results))
    subscriber.start()
    time.sleep(3)
    array = cloud(points)
    number = PackedElementFieldNumericType
    fields = [PackedElementField(name=name, offset=4 * place, type=number.Uint32 if name == "rgba" else number.Float32)
              for place, name in enumerate(array.dtype.names)]
    pose = Pose(position=Vector3(x=0, y=0, z=0), orientation=Quaternion(x=0, y=0, z=0, w=1))

    def step(_):
        array["z"] += 1e-3
        cloud_now = PointCloud(frame_id="world", pose=pose, point_stride=16, fields=fields, data=array.tobytes())
        channel.log(cloud_now, log_time=time.time_ns())

    frames, cpu_ms, reached_hz = paced(seconds, rate, step)
    bytes_per_frame, latency_p95_ms = results.get(timeout=30)
    server.stop()
    subscriber.join(10)
    return {"frames": frames, "reached_hz": reached_hz, "bytes_per_frame": bytes_per_frame,
            "producer_cpu_ms": cpu_ms, "latency_p95_ms": latency_p95_ms}


def sent_bytes(port):
    """Bytes that the server has sent on its connections, by the kernel's count."""
    told = subprocess.run(["ss", "-tinH", f"( sport = :{port} )"], capture_output=True, text=True, check=True).stdout
    counts = [int(word.split(":")[1]) for word in told.split() if word.startswith("bytes_sent:")]
    return max(counts, default=0)


def settled_bytes(port):
    """As `sent_bytes`, once what was logged has gone out: nothing was sent for two seconds."""
    last, quiet = sent_bytes(port), 0
    while quiet < 4:
        time.sleep(0.5)
        now = sent_bytes(port)
        last, quiet = now, quiet + 1 if now == last else 0
    return last


def rerun(points, rate, seconds):
    import rerun as rr

    binary, port = shutil.which("rerun"), free_port()
    environment = dict(os.environ, RERUN_ANALYTICS="0")
    quiet = {"env": environment, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    serve = [binary, "--serve-grpc", "--bind", "127.0.0.1", "--port", str(port), "--server-memory-limit", "500MB"]
    url = f"rerun+http://127.0.0.1:{port}/proxy"
    array = cloud(points)
    positions = np.stack([array[axis] for axis in "xyz"], axis=1)
    with tempfile.TemporaryDirectory() as scratch:
        server = subprocess.Popen(serve, **quiet)
        time.sleep(4)
        rr.init("bench", spawn=False)
        rr.connect_grpc(url)
        save = [binary, url, "--save", os.path.join(scratch, "received.rrd"), "--bind", "127.0.0.1",
                "--port", str(free_port())]
        subscriber = subprocess.Popen(save, **quiet)
        time.sleep(3)
        before = sent_bytes(port)

        def step(frame):
            rr.set_time("frame", sequence=frame)
            positions[:, 2] += 1e-3
            rr.log("cloud", rr.Points3D(positions, colors=array["rgba"]))

        frames, cpu_ms, reached_hz = paced(seconds, rate, step)
        sent = settled_bytes(port) - before
        for process in (subscriber, server):
            process.terminate()
            process.wait(10)
    return {"frames": frames, "reached_hz": reached_hz, "bytes_per_frame": sent / frames, "producer_cpu_ms": cpu_ms}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=100_000)
    parser.add_argument("--rate", type=float, default=30.0)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--out")
    arguments = parser.parse_args()
    load = (arguments.points, arguments.rate, arguments.seconds)
    results = {"foxglove": foxglove(*load), "rerun": rerun(*load)}
    print("| peer | bytes per frame | producer CPU per frame | reached |\n|---|---|---|---|")
    for name, found in results.items():
        print(f"| {name} | {found['bytes_per_frame'] / 1e6:.2f} MB | {found['producer_cpu_ms']:.1f} ms "
              f"| {found['reached_hz']:.1f} Hz |")
    if arguments.out:
        with open(arguments.out, "w", encoding="utf-8") as file:
            json.dump(results, file, indent=2)


if __name__ == "__main__":
    main()
