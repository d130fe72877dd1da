/** Single pictures: their kind and size, before anything is decoded. */

const LARGEST_FILE_MB = 512;

/**
 * The kind and size from a file's first bytes, if the receiver decodes such files itself; null for others.
 * @param {Uint8Array} bytes
 * @returns {{kind: string, width: number, height: number} | null}
 */
function pictureHead(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  if (bytes.length > 24 && view.getUint32(0) === 0x89504e47) return { kind: "png", width: view.getUint32(16), height: view.getUint32(20) };
  if (bytes.length > 4 && view.getUint16(0) === 0xffd8) return { kind: "jpeg", ...jpegSize(view) };
  const start = new TextDecoder("latin1").decode(bytes.subarray(0, 1000));
  const header = /^P[25]\s(?:\s*#[^\n]*\n)*\s*(\d+)\s(?:\s*#[^\n]*\n)*\s*(\d+)\s/.exec(start);
  return header ? { kind: "pgm", width: Number(header[1]), height: Number(header[2]) } : null;
}

/** Walks through the segments of a JPEG to the one with the size. @param {DataView} view */
function jpegSize(view) {
  let at = 2;
  while (at + 9 < view.byteLength && view.getUint8(at) === 0xff) {
    const marker = view.getUint8(at + 1);
    const isFrame = marker >= 0xc0 && marker <= 0xcf && ![0xc4, 0xc8, 0xcc].includes(marker);
    if (isFrame) return { height: view.getUint16(at + 5), width: view.getUint16(at + 7) };
    at += marker === 0xff ? 1 : 2 + view.getUint16(at + 2);
  }
  return { width: 0, height: 0 };
}

/** Files other than films are read whole. @param {File} file */
function refuseBig(file) {
  if (file.size <= LARGEST_FILE_MB << 20) return;
  throw new Error(`“${file.name}” has ${short(file.size / 2 ** 20)} MB, and pictures have at most ${LARGEST_FILE_MB}`);
}

/** @param {File} file A file that the browser decodes. @param {number} number @returns {Promise<Shot & {width: number, height: number}>} */
async function unpacked(file, number) {
  const bitmap = await createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none" }).catch(() => {
    throw new Error(`“${file.name}” is not a whole PNG, JPEG or PGM, nor another picture that this browser reads`);
  });
  try {
    const { width, height } = bitmap;
    refuseLarge(width, height, file.name);
    return { ...new Grabber(width, height).grab(bitmap, { number, late: 0 }), width, height };
  } finally {
    bitmap.close();
  }
}

/**
 * Finds and reads the panel in one picture.
 * @param {File} file
 * @returns {Promise<Answer>}
 */
async function decodePicture(file) {
  refuseBig(file);
  const bytes = new Uint8Array(await file.arrayBuffer());
  const head = pictureHead(bytes);
  if (head) {
    refuseLarge(head.width, head.height, file.name);
    return live.ask({ do: "decode" }, bytes);
  }
  const { width, height, bytes: pixels } = await unpacked(file, 0);
  return live.ask({ do: "decode_rgba", width, height }, pixels);
}

/**
 * The frames of a film from several pictures, in the order of their names.
 * @param {File[]} files
 * @param {number | null} fps
 * @returns {Promise<Film>}
 */
async function openPictures(files, fps) {
  const ordered = [...files].sort((a, b) => a.name.localeCompare(b.name, "en", { numeric: true }));
  const first = await shotOf(ordered[0], 0);
  const { width, height } = first;
  return { name: `${files.length} pictures`, width, height, fps, shots: pictureShots(ordered, width, height) };
}

/** @param {File[]} files @param {number} width @param {number} height @returns {AsyncGenerator<Shot>} */
async function* pictureShots(files, width, height) {
  for (const [number, file] of files.entries()) {
    const shot = await shotOf(file, number);
    if (shot.width !== width || shot.height !== height) {
      const sizes = `${shot.width} × ${shot.height} pixels large, and the first picture ${width} × ${height}`;
      throw new Error(`“${file.name}” is ${sizes}: they are no film`);
    }
    yield shot;
  }
}

/** @param {File} file @param {number} number @returns {Promise<Shot & {width: number, height: number}>} */
async function shotOf(file, number) {
  refuseBig(file);
  const head = pictureHead(await readSlice(file, 0, 1 << 20));
  if (head) refuseLarge(head.width, head.height, file.name);
  if (head?.kind === "pgm") {
    // Browsers cannot show these.
    const { answer, bytes } = await live.ask({ do: "decode" }, new Uint8Array(await file.arrayBuffer()));
    const { width, height } = answer;
    return { number, late: 0, format: "grey", bytes, width, height, paint: (picture) => picture.showGrey(bytes, width, height) };
  }
  return unpacked(file, number);
}
