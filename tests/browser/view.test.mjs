// The page of `vocc receive --view` shows what the program prints.

import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import path from "node:path";
import test from "node:test";
import { setTimeout as wait } from "node:timers/promises";
import {
  film, framesOf, keyFile, PATIENCE_MS, receiving, receivingLive, shots, textOf, visit, vocc, VOCC_PAGE, workshop,
} from "./browser.mjs";

/** A text that would be an element, and would run, where it is taken as HTML. */
const TEXT = '<img src=x onerror="document.title=1"> & ice';

/** The size of frames before a live source's page. */
const SIZE = [640, 480];

/** What the Receive tab consists of in both pages. */
const SHARED = ["words.js", "say.js", "picture.js", "leds.js", "panel.js", "messages.js", "receive.js", "style.css"];

/** With the address of a receiver's page. */
async function viewed(receiver) {
  const address = await receiver.said("view: ");
  return { ...receiver, address, isOwn: (url) => url.startsWith(address) };
}

test("view: a film is shown as it is printed", async (t) => {
  const folder = workshop(t);
  const [keys, camera] = ["keys.toml", "camera.toml"].map((name) => path.join(folder, name));
  const key = keyFile(folder);
  writeFileSync(keys, vocc("keys", "show", key));
  // The scene's 25 mm on pixels of 6.875 µm.
  writeFileSync(camera, "focal_px = 3636.36\n");
  const size = ["--set", "camera.width_px=640", "--set", "camera.height_px=480"];
  const frames = readFileSync(film(folder, 100, ["day", ...size, "--message", TEXT, "--sign", key, "--counter", "7"]));
  const told = ["--trust", keys, "--camera", camera, "--interval", "1", "--led-diameter", "0.03"];
  const { program, address, ended, lines, isOwn } = await viewed(receiving(t, "-", "--bits", "--view", ...told));
  const page = await visit(t, address, { isOwn });
  await textOf(page, "#receive-state", /^Receiving: looking for a panel in standard input …$/);
  for (let at = 0; at < frames.length; at += 1 << 20) {
    program.stdin.write(frames.subarray(at, at + (1 << 20)));
    await wait(30);
  }
  program.stdin.end();
  await textOf(page, "#receive-state", /^Ended: \d+ messages? came; a panel was read in \d+ of \d+ frames\. This page/);
  const [status] = await ended;
  assert.equal(status, 0);

  const read = lines().filter(({ bits }) => bits);
  const last = read.at(-1);
  // The picture is decoded after the words have come.
  await textOf(page, "#receive-says", new RegExp(`^Frame ${last.frame}: 640 × 480 pixels`));
  await textOf(page, "#receive-panels .bits", new RegExp(`^Bits ${last.bits}, held right by `));
  const lamps = await page.getAttribute("#receive-panels .leds", "aria-label");
  const rows = lamps.replace("Bits read, row by row: ", "").split(" ").join("");
  assert.equal(rows, [...BigInt(`0x${last.bits}`).toString(2).padStart(64, "0")].reverse().join(""));
  const outline = await page.getAttribute("#receive-picture polygon", "points");
  const points = outline.split(" ").map((point) => point.split(",").map(Number));
  for (const axis of [0, 1]) {
    const middle = points.reduce((sum, point) => sum + point[axis], 0) / 4 - 0.5;
    assert.ok(Math.abs(middle - last.centre_px[axis]) < 1, `${middle} and ${last.centre_px}`);
  }
  assert.equal(last.pose.known, true);
  const pose = await page.textContent("#receive-panels dl");
  for (const [name, value, sigma] of [["Range", "range_m", "range_sigma_m"], ["Bearing", "azimuth_deg", "azimuth_sigma_deg"]]) {
    const [, shown] = new RegExp(`${name}(−?[\\d.]+) ± `).exec(pose);
    // It is shown to two digits of what is known.
    const off = Math.abs(Number(shown.replace("−", "-")) - last.pose[value]);
    assert.ok(off < last.pose[sigma] / 10, `${name} ${shown}: ${last.pose[value]}`);
  }

  const sent = lines().filter(({ message }) => message);
  assert.deepEqual(sent.map(({ message }) => message), sent.map(() => TEXT));
  assert.ok(sent.some(({ verdict }) => verdict === "proven"));
  assert.equal(await page.locator("#texts p").count(), 1);
  assert.equal(await page.textContent("#texts p bdi"), TEXT);
  assert.equal(await page.locator("#texts img").count(), 0);
  assert.match(await page.textContent("#texts .verdict"), /^signed by truck 12 \([0-9a-f]+\), counter 7: proven$/);
  assert.equal(await page.isVisible("#unchecked"), false);
  const proof = { verdict: "forged", signer: "1a2b3c4d", signer_name: "truck", counter: 7 };
  const forged = await page.evaluate((told) => verdictOn(told)[0].textContent, proof);
  assert.equal(forged, "truck (1a2b3c4d) has not signed this, counter 7: forged");
  assert.equal(await page.textContent("#alert"), "");
  await textOf(page, "#learnt", /Blur, px\d/);
  for (const width of [400, 1280]) {
    await page.setViewportSize({ width, height: 900 });
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `nothing reaches beyond ${width} px`);
    await page.screenshot({ path: path.join(shots, `view-${width}.png`), fullPage: true });
  }
});

test("view: the page is the Receive tab of the project's own page, without what feeds it there", async (t) => {
  const { address, isOwn } = await viewed(receiving(t, "-", "--view", "--raw", "64x48"));
  const page = await visit(t, address, { isOwn, mayComplain: true });
  const own = readFileSync(VOCC_PAGE, "utf8");
  const [served, ...files] = await Promise.all(["", "script.js", "style.css"].map(async (name) => (await fetch(address + name)).text()));
  // As it is before a script has changed it.
  const parsed = (html) => new DOMParser().parseFromString(html, "text/html").querySelector("#received").outerHTML;
  assert.equal(await page.evaluate(parsed, served), await page.evaluate(parsed, own));
  for (const name of SHARED) {
    const text = readFileSync(new URL(`../../page/web/${name}`, import.meta.url), "utf8");
    // `page/build` leaves out indentation, and the lines that are empty or only a comment.
    assert.ok(own.includes(text.replace(/^ *(\/\/.*)?\n/gm, "").replace(/^ +/gm, "")), name);
    assert.ok(files.join("").includes(text), name);
  }
  assert.equal(await page.locator("button, input, select, textarea").count(), 0);
});

test("view: a live source shows its latency, and is waited for", { timeout: PATIENCE_MS }, async (t) => {
  const frames = framesOf(workshop(t), SIZE, ["day", "--message", TEXT, "--frames", "24"]);
  const { program, address, camera, ended, lines, isOwn } = await viewed(receivingLive(t, SIZE, "--bits", "--view"));
  const page = await visit(t, address, { isOwn, mayComplain: true });
  await textOf(page, "#receive-state", /^Live: /);
  // The page shows each frame before the next one is there.
  let source = camera();
  for (const [at, frame] of frames.entries()) {
    source.write(frame);
    const said = `^Frame ${at}: 640 × 480 pixels, [\\d.]+ symbols a second, latency [\\d.]+\\s(µs|ms|s)$`;
    await textOf(page, "#receive-says", new RegExp(said));
  }
  await textOf(page, "#texts p", /frames \d+ to \d+, \d+ bits? corrected, latency [\d.]+\s(µs|ms|s)/);
  assert.equal(await page.textContent("#texts p bdi"), TEXT);
  source.end();
  await textOf(page, "#remarks", /camera is gone: waiting for it/);
  source = camera();
  source.write(frames[0]);
  await textOf(page, "#remarks", /camera is back after [\d.]+ s/);
  await textOf(page, "#receive-state", /^Live: /);
  assert.equal(await page.isVisible("#latency"), false);

  program.kill("SIGINT");
  assert.deepEqual(await ended, [0, null]);
  // After Ctrl-C the program does not wait long for the page to take the end.
  await textOf(page, "#receive-state", new RegExp(`^Ended: .* of ${frames.length + 1} frames\\.|^Not connected$`));
});

test("view: a live source that ends shows the latencies that are printed", { timeout: PATIENCE_MS }, async (t) => {
  const frames = framesOf(workshop(t), SIZE, ["day", "--message", TEXT, "--frames", "4"]);
  const { program, address, ended, lines, isOwn } = await viewed(receiving(t, "--live", "-", "--raw", SIZE.join("x"), "--view"));
  const page = await visit(t, address, { isOwn });
  await textOf(page, "#receive-state", /^Live: /);
  program.stdin.end(Buffer.concat(frames));
  await textOf(page, "#receive-state", /^Ended: /);
  await ended;
  const { latency } = lines().at(-1);
  const units = { µs: 1e-6, ms: 1e-3, s: 1 };
  const shown = await page.locator("#latency dd").allTextContents();
  assert.deepEqual(await page.locator("#latency dt").allTextContents(), ["All", "Queue", "Reading", "Decoding"]);
  for (const [at, part] of ["to_text", "queue", "reading", "decoding"].entries()) {
    const [median_s, worst_s] = [...shown[at].matchAll(/([\d.]+)\s(µs|ms|s)/g)].map(([, value, unit]) => value * units[unit]);
    const { median_s: median, worst_s: worst } = latency[part];
    assert.ok(Math.abs(median_s - median) <= 0.01 * median && Math.abs(worst_s - worst) <= 0.01 * worst, `${part}: ${shown[at]}`);
  }
});

test("view: the page says why nothing is read, and that the program was stopped", async (t) => {
  const { program, address, isOwn } = await viewed(receiving(t, "-", "--view", "--raw", "64x48"));
  const page = await visit(t, address, { isOwn, mayComplain: true });
  program.stdin.write(Buffer.alloc(64 * 48, 90));
  await textOf(page, "#receive-panels .why", /^Not read: .*no candidate/);
  program.kill("SIGKILL");
  await textOf(page, "#alert", /^vocc does not answer/);
  await textOf(page, "#receive-panels .why", /^Not read: .*no candidate/);
});

test("view: a name that resolves to this computer is refused", async (t) => {
  const { address, isOwn } = await viewed(receiving(t, "-", "--view", "--raw", "64x48"));
  const flags = ["--host-resolver-rules=MAP evil.example 127.0.0.1"];
  const page = await visit(t, address, { isOwn: (url) => isOwn(url) || url.includes("evil.example"), flags, mayComplain: true });
  const answer = await page.goto(address.replace("127.0.0.1", "evil.example"));
  assert.equal(answer.status(), 403);
  // Nor does another page on this computer read the events. Its own policy allows it to try.
  const other = createServer((_, response) => response.setHeader("Content-Type", "text/html").end("<title>other</title>"));
  t.after(() => other.close());
  await new Promise((listening) => other.listen(0, "127.0.0.1", listening));
  const elsewhere = `http://127.0.0.1:${other.address().port}/`;
  const stranger = await visit(t, elsewhere, { isOwn: (url) => isOwn(url) || url.startsWith(elsewhere), mayComplain: true });
  const status = (url) => fetch(url).then(({ status }) => status, () => "refused");
  assert.equal(await stranger.evaluate(status, elsewhere), 200);
  assert.equal(await stranger.evaluate(status, `${address}events`), "refused");
});
