"""What the tool makes of a set: delivered messages, raw bit errors, panels in a wrong place. Nothing is told but the two rates."""

import json
import subprocess

import numpy as np

# Frames whose exposure holds more than that share of the next symbol do not show their own.
MIXED = 0.02


def truths(folder, name):
    """Path and truth of each member of a set, in order."""
    for path in sorted(folder.glob(name)):
        yield path, json.loads(path.read_text())


def receive(vocc, film, args):
    """What `vocc receive` prints of a film: lines of JSON, and its last complaint."""
    command = [vocc, "receive", "--bits", "--json", "--fps", str(args["fps"]), "--symbol-rate", str(args["symbol_rate"])]
    command += args.get("receive_args", [])
    if (film / "film.mp4").exists():
        decode = ["ffmpeg", "-loglevel", "error", "-i", str(film / "film.mp4"), "-f", "yuv4mpegpipe", "-"]
        with subprocess.Popen(decode, stdout=subprocess.PIPE) as stream:
            ended = subprocess.run([*command, "-"], stdin=stream.stdout, capture_output=True, text=True)
    else:
        ended = subprocess.run([*command, str(film)], capture_output=True, text=True)
    lines = [json.loads(line) for line in ended.stdout.splitlines() if line.startswith("{")]
    complaints = ended.stderr.strip().splitlines()
    return lines, complaints[-1] if complaints else ""


def evaluate_film(vocc, film, truth):
    """One film: delivered or not, frames read, wrong places, bit errors of read frames; broken LEDs and mixed frames apart."""
    lines, complaint = receive(vocc, film, truth["args"])
    numbers = sorted(int(path.stem) for path in film.iterdir() if path.stem.isdigit())
    kept = numbers or [frame["frame"] for frame in truth["frames"] if not frame["lost"]]
    frames = {frame["frame"]: frame for frame in truth["frames"]}
    working = sum(1 << led for led in range(64) if led not in truth["dead_leds"])
    result = {"set": film.name, "delivered": False, "frames": len(kept), "read": 0, "misplaced": 0, "errors": 0, "bits": 0, "why": ""}
    for line in lines:
        result["delivered"] |= "Lane closed ahead" in str(line.get("message", ""))
        if "bits" not in line or "frame" not in line or line["frame"] >= len(kept):
            continue
        frame = frames[kept[line["frame"]]]
        result["read"] += 1
        result.setdefault("first", line["frame"])
        apart = np.hypot(*(np.array(frame["centre_px"]) - line["centre_px"]))
        result["misplaced"] += int(apart > 0.5 * frame["pitch_px"])
        if frame["mixed_with_next"] <= MIXED:
            result["errors"] += ((int(frame["bits"], 16) ^ int(line["bits"], 16)) & working).bit_count()
            result["bits"] += working.bit_count()
    if not result["delivered"]:
        result["why"] = complaint
    return result


def evaluate_films(vocc, folder):
    """All films of a folder, one after the other."""
    for path, truth in truths(folder, "*/truth.json"):
        yield evaluate_film(vocc, path.parent, truth)


def evaluate_pictures(vocc, folder):
    """All single pictures of a folder."""
    for path, truth in truths(folder, "*.json"):
        picture = next(path.with_suffix(end) for end in (".png", ".jpg") if path.with_suffix(end).exists())
        ended = subprocess.run([vocc, "decode", "--json", str(picture)], capture_output=True, text=True)
        seen = json.loads(ended.stdout.splitlines()[0]) if ended.stdout else {}
        result = {"picture": picture.name, "found": bool(seen.get("found")), "misplaced": 0, "errors": 0, "bits": 0}
        result["why"] = "" if result["found"] else str(seen.get("why") or ended.stderr.strip())
        if result["found"]:
            corners = np.array(truth["led_corner_centres_px"])
            pitch = np.hypot(*(corners[1] - corners[0])) / 7
            result["misplaced"] = int(np.hypot(*(corners.mean(axis=0) - seen["centre_px"])) > 0.4 * pitch)
            bits = int("".join(truth["bits"])[::-1], 2)
            working = sum(1 << led for led in range(64) if led not in truth["dead_leds"])
            result["errors"] = ((bits ^ int(seen["bits"], 16)) & working).bit_count()
            result["bits"] = working.bit_count()
        yield result


def summary(results, what, good):
    """The sums over a set."""
    results = list(results)
    total = {key: sum(result[key] for result in results) for key in (good, "misplaced", "errors", "bits")}
    return {"summary": what, "of": len(results), **total}


def evaluate_deceivers(vocc, folder):
    """All pictures without a panel of a folder: is one seen?"""
    for picture in sorted(folder.iterdir()):
        ended = subprocess.run([vocc, "decode", "--json", str(picture)], capture_output=True, text=True)
        seen = json.loads(ended.stdout.splitlines()[0])
        yield {"picture": picture.name, "found": bool(seen["found"]), "misplaced": 0, "errors": 0, "bits": 0, "why": str(seen.get("why") or "")}


def report(results, what, good, as_json):
    """Prints each result as it comes, and the sums, which it gives."""
    kept = []
    for result in results:
        kept.append(result)
        print(json.dumps(result) if as_json else words(result), flush=True)
    total = summary(kept, what, good)
    if as_json:
        print(json.dumps(total))
    elif kept:
        share = total["errors"] / max(1, total["bits"])
        arrived = f"{total[good]} of {total['of']} {good}, {total['misplaced']} misplaced"
        print(f"{what}: {arrived}, {total['errors']} of {total['bits']} bits wrong ({share:.3%})")
    return total


def words(result):
    """A result on a line."""
    errors = f"wrong {result['errors']}/{result['bits']}  {result['why'][:150]}"
    if "set" in result:
        state = "delivered" if result["delivered"] else "NOT"
        read = f"read {result['read']}/{result['frames']}, first {result.get('first', '-')}"
        return f"{result['set']:12} {state:9} {read}, misplaced {result['misplaced']}, {errors}"
    state = "MISPLACED" if result["misplaced"] else "found" if result["found"] else "NOT"
    return f"{result['picture']:26} {state:9} {errors}"
