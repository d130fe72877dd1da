// `vocc receive --foxglove` with Foxglove's own client and decoders, and with a page of Foxglove's origin in Chromium.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { once } from "node:events";
import { writeFileSync } from "node:fs";
import path from "node:path";
import test from "node:test";
import rosmsg from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import protocol from "@foxglove/ws-protocol";
import WebSocket from "ws";
import { framesOf, PATIENCE_MS, receivingLive, visit, workshop } from "./browser.mjs";

// These packages are CommonJS.
const { FoxgloveClient } = protocol;
const SIZE = [320, 240];
const FRAMES = 24;
const MESSAGE = "Lorry broken down & 200 m ahead";

/** Starts `vocc receive --live --foxglove`. */
async function served(t, ...words) {
  const receiver = receivingLive(t, SIZE, "--foxglove=0", ...words);
  return { ...receiver, address: await receiver.said("Foxglove connects to ") };
}

/** Foxglove's client. Each message is decoded by the schema that the server has advertised. */
async function connected(t, address) {
  const socket = new WebSocket(address, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
  t.after(() => socket.terminate());
  const client = new FoxgloveClient({ ws: socket });
  /** By topic: the schema's name, the subscription, and the messages. */
  const topics = new Map();
  let heard = () => {};
  client.on("error", (error) => assert.fail(error));
  client.on("advertise", (channels) => {
    for (const { id, topic, encoding, schemaEncoding, schemaName, schema } of channels) {
      assert.deepEqual([encoding, schemaEncoding], ["cdr", "ros2msg"]);
      const reader = new MessageReader(rosmsg.parse(schema, { ros2: true }));
      topics.set(topic, { schemaName, reader, subscription: client.subscribe(id), received: [] });
    }
  });
  client.on("message", ({ subscriptionId, timestamp, data }) => {
    const [topic, { reader, received }] = [...topics].find(([, { subscription }]) => subscription === subscriptionId);
    received.push({ timestamp, message: reader.readMessage(data) });
    assert.ok(!reader.lastReadHadTrailingBytes(), topic);
    heard();
  });
  // Channels are advertised after the server's information, and this one last.
  const advertised = new Promise((told) => client.on("advertise", () => topics.has("/diagnostics") && told()));
  const info = await new Promise((told) => client.on("serverInfo", told));
  await advertised;
  const received = (topic) => topics.get(topic)?.received ?? [];
  const until = async (condition) => {
    while (!condition()) await new Promise((next) => (heard = next));
  };
  /** Requests before a ping are done before its answer. */
  const settle = () => {
    socket.ping();
    return once(socket, "pong");
  };
  return { client, socket, info, topics, received, until, settle };
}

/** The pixels of a picture, by ffmpeg. */
function pixelsOf(picture) {
  return execFileSync("ffmpeg", ["-v", "error", "-i", "-", "-pix_fmt", "gray", "-f", "rawvideo", "-"], { input: picture });
}

test("foxglove: its own client reads images and messages of a live source", { timeout: PATIENCE_MS }, async (t) => {
  const folder = workshop(t);
  const calibration = path.join(folder, "camera.toml");
  writeFileSync(calibration, "focal_px = 3636.36\n");
  const frames = framesOf(folder, SIZE, ["day", "--message", MESSAGE, "--frames", String(FRAMES)]);
  const began = Date.now();
  const known = ["--camera", calibration, "--interval", "1", "--led-diameter", "0.03", "--frame-id", "front_camera"];
  const { program, address, camera, ended } = await served(t, ...known);
  const { client, socket, info, topics, received, until, settle } = await connected(t, address);
  assert.equal(socket.protocol, "foxglove.websocket.v1");
  assert.match(info.name, /^vocc \d/);
  await settle();
  const images = received("/camera/image");
  const source = camera();
  for (const [at, frame] of frames.entries()) {
    source.write(frame);
    await until(() => images.length > at);
    // The channel of the calibration comes with the first frame.
    await settle();
  }
  await until(() => received("/panel_0/message").length);
  for (const { timestamp, message } of images) {
    assert.deepEqual([message.header.frame_id, message.format], ["front_camera", "mono8; png compressed"]);
    assert.equal(BigInt(message.header.stamp.sec) * 10n ** 9n + BigInt(message.header.stamp.nanosec), timestamp);
    assert.ok(timestamp >= BigInt(began) * 10n ** 6n && timestamp <= BigInt(Date.now() + 1) * 10n ** 6n);
  }
  for (const at of [0, FRAMES - 1]) assert.ok(pixelsOf(images[at].message.data).equals(frames[at]), `frame ${at}`);
  assert.deepEqual([...topics].map(([topic, { schemaName }]) => [topic, schemaName]), [
    ["/camera/image", "sensor_msgs/msg/CompressedImage"],
    ["/panel_0/outline", "foxglove_msgs/msg/ImageAnnotations"],
    ["/panel_0/pose", "geometry_msgs/msg/PoseWithCovarianceStamped"],
    ["/panel_0/message", "std_msgs/msg/String"],
    ["/panel_0/message_bytes", "std_msgs/msg/UInt8MultiArray"],
    ["/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"],
    ["/camera/camera_info", "sensor_msgs/msg/CameraInfo"],
  ]);
  assert.equal(received("/panel_0/message")[0].message.data, MESSAGE);
  assert.equal(Buffer.from(received("/panel_0/message_bytes")[0].message.data).toString(), MESSAGE);
  const [{ message: outline }] = received("/panel_0/outline");
  assert.match(outline.texts[0].text, /^[0-9a-f]{16}$/);
  assert.ok(outline.points[0].points.every(({ x, y }) => x > 0 && x < SIZE[0] && y > 0 && y < SIZE[1]));
  const range = Math.hypot(...["x", "y", "z"].map((axis) => received("/panel_0/pose").at(-1).message.pose.pose.position[axis]));
  assert.ok(Math.abs(range - 50) < 5, `${range} m`);
  assert.equal(received("/camera/camera_info")[0].message.k[0], 3636.36);
  assert.equal(received("/diagnostics")[0].message.status[0].name, "vocc: camera");

  // What is no longer wanted is no longer sent.
  client.unsubscribe(topics.get("/camera/image").subscription);
  await settle();
  source.write(frames[0]);
  await until(() => received("/camera/camera_info").at(-1).timestamp > images.at(-1).timestamp);
  assert.equal(images.length, FRAMES);
  const closed = new Promise((told) => client.on("close", told));
  program.kill("SIGINT");
  await closed;
  assert.deepEqual(await ended, [0, null]);
});

test("foxglove: Chromium connects from Foxglove's page, and from no other", { timeout: PATIENCE_MS }, async (t) => {
  const { address } = await served(t);
  // Chromium asks its user whether a site may connect to this computer.
  const context = { permissions: ["local-network-access"] };
  const connect = ([address, protocol]) => new Promise((told) => {
    const socket = new WebSocket(address, [protocol]);
    socket.onmessage = ({ data }) => told(JSON.parse(data).op);
    socket.onerror = () => told("refused");
  });
  for (const [site, answer] of [["https://app.foxglove.dev/", "serverInfo"], ["https://foxglove.example/", "refused"]]) {
    const page = await visit(t, "about:blank", { isOwn: (url) => url === site, context, mayComplain: answer === "refused" });
    await page.route(site, (route) => route.fulfill({ contentType: "text/html", body: '<link rel="icon" href="data:,">' }));
    await page.goto(site);
    assert.equal(await page.evaluate(connect, [address, FoxgloveClient.SUPPORTED_SUBPROTOCOL]), answer, site);
  }
});
