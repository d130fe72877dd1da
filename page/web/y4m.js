/** Films in y4m files: uncompressed frames after a header line. They are read in slices, never whole. */

/** Maximum length of a line in a y4m file. */
const LONGEST_LINE = 1024;

/**
 * @typedef {object} Shot A frame on its way to the receiver.
 * @property {number} number
 * @property {number} late In frame periods.
 * @property {string} format
 * @property {Uint8Array} bytes
 * @property {(picture: Picture) => void} paint Must be called before the bytes are transferred.
 *
 * @typedef {object} Film
 * @property {string} name
 * @property {number} width
 * @property {number} height
 * @property {number | null} fps
 * @property {boolean} [isAssumed] Whether the frame rate is assumed.
 * @property {boolean} [isY4m]
 * @property {boolean} [isLive]
 * @property {AsyncIterable<Shot>} shots
 * @property {() => void} [close]
 */

/** @param {Blob} file @param {number} from @param {number} length */
async function readSlice(file, from, length) {
  try {
    return new Uint8Array(await file.slice(from, from + length).arrayBuffer());
  } catch (error) {
    throw new Error(`The file cannot be read any further: ${/** @type {Error} */ (error).message}`);
  }
}

/** @param {File} file @returns {Promise<boolean>} */
async function isY4m(file) {
  return new TextDecoder().decode(await readSlice(file, 0, 9)) === "YUV4MPEG2";
}

/** @param {File} file @param {() => boolean} isWanted @returns {Promise<Film>} */
async function openY4m(file, isWanted) {
  const start = await readSlice(file, 0, LONGEST_LINE);
  const end = start.indexOf(10);
  if (end < 0) throw new Error(`“${file.name}” does not begin as y4m films do: it is damaged, or another kind of file`);
  const line = start.slice(0, end);
  const tags = new TextDecoder().decode(line);
  giveUpUnless(isWanted);
  const { answer } = await live.ask({ do: "y4m_begin" }, line);
  const { width, height, fps, frame_bytes: frameBytes } = answer;
  const depth = Number(/ C\S*?(?:p|mono)(9|1\d)\b/.exec(tags)?.[1] ?? 8);
  const shots = y4mShots(file, end + 1, { width, height, frameBytes, depth });
  return { name: file.name, width, height, fps, isY4m: true, shots };
}

/**
 * @param {File} file
 * @param {number} from The offset of the first frame.
 * @param {{width: number, height: number, frameBytes: number, depth: number}} kind
 * @returns {AsyncGenerator<Shot>}
 */
async function* y4mShots(file, from, { width, height, frameBytes, depth }) {
  let at = from;
  for (let number = 0; at < file.size; number += 1) {
    const slice = await readSlice(file, at, LONGEST_LINE + frameBytes);
    const lineEnd = slice.subarray(0, LONGEST_LINE).indexOf(10);
    if (lineEnd < 0 || new TextDecoder().decode(slice.subarray(0, 5)) !== "FRAME") {
      throw new Error(`The film is damaged: frame ${number} does not begin where it should, ${short(at, 12)} bytes into the file`);
    }
    const end = lineEnd + 1 + frameBytes;
    if (slice.length < end) throw new Error(`The film is cut off inside frame ${number}`);
    const bytes = slice.slice(0, end);
    const paint = (/** @type {Picture} */ picture) => picture.showGrey(luma(bytes, lineEnd + 1, width * height, depth), width, height);
    yield { number, late: 0, format: "y4m", bytes, paint };
    at += end;
  }
}

/** The luma of a frame, which comes first in it. @returns {Uint8Array} */
function luma(bytes, from, pixels, depth) {
  if (depth === 8) return bytes.subarray(from, from + pixels);
  const grey = new Uint8Array(pixels);
  for (let at = 0; at < pixels; at += 1) grey[at] = (bytes[from + 2 * at] | (bytes[from + 2 * at + 1] << 8)) >> (depth - 8);
  return grey;
}
