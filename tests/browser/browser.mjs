// The page in Chromium, and the program for comparison.

import { execFileSync, spawn } from "node:child_process";
import { once } from "node:events";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import readline from "node:readline";
import { after } from "node:test";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const { VOCC, CHROMIUM } = process.env;
/** The file of the page. */
export const { VOCC_PAGE } = process.env;

/** A timeout that even a busy computer does not reach. */
export const PATIENCE_MS = 300_000;

/** The running browsers, by their flags. */
const browsers = new Map();
after(async () => {
  for (const browser of browsers.values()) await (await browser).close();
});

function launched(flags) {
  const name = flags.join(" ");
  if (!browsers.has(name)) browsers.set(name, chromium.launch({ executablePath: CHROMIUM, args: ["--no-sandbox", ...flags], timeout: PATIENCE_MS }));
  return browsers.get(name);
}

/** The folder for screenshots of the page. */
export const shots = path.dirname(VOCC_PAGE);

/** A test's own folder for its files. */
export function workshop(t) {
  const folder = mkdtempSync(path.join(tmpdir(), "vocc-page-"));
  t.after(() => rmSync(folder, { recursive: true }));
  return folder;
}

/**
 * Writes a private key, which only its owner may read, and returns its path. It is always the same, because signatures decide which panels
 * a camera sees.
 */
export function keyFile(folder) {
  const file = path.join(folder, "key.toml");
  const [name, secret] = ["truck 12", "76a9b3af16eff1491fa7489351e3199f245aed57af308c2ed9c3f6741e24967f"];
  const key = { name, public: "80bafe5ab9dbbb0958760954b8d6019c1f16aa6caf9eed2ba533caececea7e4e", secret };
  writeFileSync(file, Object.entries(key).map(([field, value]) => `${field} = "${value}"\n`).join(""), { mode: 0o600 });
  return file;
}

/** The output of `vocc`; status 1 is a valid result. */
export function vocc(...words) {
  try {
    return execFileSync(VOCC, words, { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] });
  } catch (error) {
    if (error.status === 1) return error.stdout;
    throw error;
  }
}

/** Films `vocc link` with these arguments and encodes a film as cameras do. */
export function film(folder, fps, words, name = "film.y4m") {
  const frames = path.join(folder, `frames-${name}`);
  vocc("link", ...words, "--save", frames);
  const file = path.join(folder, name);
  const input = ["-framerate", String(fps), "-i", path.join(frames, "frame-%06d.png")];
  execFileSync("ffmpeg", ["-v", "error", "-y", ...input, "-pix_fmt", "yuv420p", file], { stdio: "inherit" });
  return file;
}

/** Films `vocc link` with these arguments: the grey pixels of each frame. */
export function framesOf(folder, [width, height], words) {
  const frames = path.join(folder, "frames");
  const size = [`camera.width_px=${width}`, `camera.height_px=${height}`].flatMap((key) => ["--set", key]);
  vocc("link", ...words, ...size, "--save", frames);
  const grey = ["-pix_fmt", "gray", "-f", "rawvideo", "-"];
  const pixels = execFileSync("ffmpeg", ["-v", "error", "-i", path.join(frames, "frame-%06d.png"), ...grey], { maxBuffer: Infinity });
  const bytes = width * height;
  return Array.from({ length: pixels.length / bytes }, (_, at) => pixels.subarray(at * bytes, (at + 1) * bytes));
}

/** Starts `vocc receive` with these arguments. `said` waits for what a line on standard error begins with, and returns its rest. */
export function receiving(t, ...words) {
  const program = spawn(VOCC, ["receive", "--json", ...words], { stdio: "pipe" });
  t.after(() => program.kill("SIGKILL"));
  const ended = once(program, "close");
  let printed = "";
  program.stdout.on("data", (bytes) => (printed += bytes));
  const remarks = [];
  const reader = readline.createInterface(program.stderr).on("line", (line) => remarks.push(line));
  let hasEnded = false;
  ended.then(() => (hasEnded = true));
  const said = async (beginning) => {
    for (;;) {
      const remark = remarks.find((line) => line.startsWith(beginning));
      if (remark) return remark.slice(beginning.length);
      await Promise.race([once(reader, "line"), ended]);
      if (hasEnded) throw new Error(`vocc ended and said ${JSON.stringify(remarks)}`);
    }
  };
  const lines = () => printed.trim().split("\n").map((line) => JSON.parse(line));
  return { program, ended, lines, said };
}

/** Starts `vocc receive --live` with a named pipe of raw frames. Each `camera()` is a program that writes to it. */
export function receivingLive(t, [width, height], ...words) {
  const pipe = path.join(workshop(t), "camera");
  execFileSync("mkfifo", [pipe]);
  const camera = () => {
    // Opening a pipe blocks until its other side is open, and Node.js does not end before.
    const writer = spawn("sh", ["-c", 'exec cat >"$1"', "sh", pipe], { stdio: ["pipe", "inherit", "inherit"] });
    t.after(() => writer.kill("SIGKILL"));
    return writer.stdin;
  };
  return { ...receiving(t, "--live", pipe, "--raw", `${width}x${height}`, ...words), camera };
}

/**
 * Opens the page. It closes with the test. The test fails if the page has requested anything or reported an error.
 * @param {{address?: string, flags?: string[], context?: object}} how
 */
export async function open(t, { address = "", ...how } = {}) {
  const own = pathToFileURL(VOCC_PAGE).href;
  const page = await visit(t, own + address, { ...how, isOwn: (url) => url.split("#")[0] === own });
  await page.evaluate(() => window.vocc.ready);
  return page;
}

/**
 * Opens any page in the same way; `isOwn` says what it may ask for, `mayComplain` that its complaints are expected.
 * @param {{isOwn: (url: string) => boolean, mayComplain?: boolean, flags?: string[], context?: object}} how
 */
export async function visit(t, address, { isOwn, mayComplain = false, flags = [], context = {} }) {
  const browsing = await (await launched(flags)).newContext(context);
  browsing.setDefaultTimeout(PATIENCE_MS);
  const page = await browsing.newPage();
  const wrong = [];
  page.on("console", (message) => message.type() === "error" && wrong.push(message.text()));
  page.on("pageerror", (error) => wrong.push(String(error)));
  page.on("request", (request) => {
    if (!/^(blob|data):/.test(request.url()) && !isOwn(request.url())) wrong.push(`asks for ${request.url()}`);
  });
  t.after(async () => {
    await browsing.close();
    if (wrong.length && !mayComplain) throw new Error(`the page complains: ${wrong.join("; ")}`);
  });
  await page.goto(address);
  return page;
}

/** Sends a request to the page's simulator; the bytes of the answer come as an array. */
export async function ask(page, request, bytes) {
  return page.evaluate(async ([request, bytes]) => {
    const given = bytes && new Uint8Array(bytes);
    const { answer, bytes: got } = await window.vocc.ask(request, given);
    return { answer, bytes: got && Array.from(got) };
  }, [request, bytes && Array.from(bytes)]);
}

/** The text of an element, once it matches. */
export async function textOf(page, selector, pattern) {
  const element = page.locator(selector);
  await page.waitForFunction(
    ([selector, source]) => new RegExp(source).test(document.querySelector(selector)?.textContent ?? ""),
    [selector, pattern.source],
  ).catch(async () => {
    throw new Error(`${selector} says ${JSON.stringify(await element.textContent())}, and not ${pattern}`);
  });
  return element.textContent();
}
