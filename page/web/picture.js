/** Pictures of a camera on a canvas. */

/** Each grey level as a pixel of a canvas. */
const GREYS = Uint32Array.from({ length: 256 }, (_, grey) => (0xff000000 | (grey * 0x010101)) >>> 0);

/** A picture with the panel's outline over it; buffers are kept from frame to frame. */
class Picture {
  /** @param {HTMLElement} place @param {string} name What it shows, for those who do not see it. */
  constructor(place, name) {
    this.canvas = make("canvas", { width: 1, height: 1 });
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", name);
    this.name = name;
    this.context = this.canvas.getContext("2d");
    this.outline = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    this.outline.setAttribute("preserveAspectRatio", "none");
    this.outline.setAttribute("aria-hidden", "true");
    place.append(this.canvas, this.outline);
    /** @type {ImageData | null} */
    this.image = null;
  }

  /** @param {number} width @param {number} height @returns {ImageData} */
  resize(width, height) {
    if (this.image?.width !== width || this.image.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
      this.image = this.context.createImageData(width, height);
      this.outline.setAttribute("viewBox", `0 0 ${width} ${height}`);
    }
    return /** @type {ImageData} */ (this.image);
  }

  /** @param {Uint8Array} grey @param {number} width @param {number} height */
  showGrey(grey, width, height) {
    const image = this.resize(width, height);
    const pixels = new Uint32Array(image.data.buffer);
    for (let at = 0; at < pixels.length; at += 1) pixels[at] = GREYS[grey[at]];
    this.context.putImageData(image, 0, 0);
  }

  /**
   * Shows the surroundings of a panel in another picture.
   * @param {Picture} from
   * @param {number[][]} corners
   */
  showAround(from, corners) {
    const xs = corners.map(([x]) => x);
    const ys = corners.map(([, y]) => y);
    const margin = Math.max(3, 0.2 * Math.max(Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys)));
    const left = Math.floor(Math.min(...xs) - margin);
    const top = Math.floor(Math.min(...ys) - margin);
    const width = Math.ceil(Math.max(...xs) + margin) - left;
    const height = Math.ceil(Math.max(...ys) + margin) - top;
    this.resize(width, height);
    this.context.clearRect(0, 0, width, height);
    this.context.drawImage(from.canvas, left, top, width, height, 0, 0, width, height);
    this.showCorners(corners.map(([x, y]) => [x - left, y - top]));
  }

  /** @param {HTMLImageElement} image */
  showImage(image) {
    this.resize(image.naturalWidth, image.naturalHeight);
    this.context.drawImage(image, 0, 0);
  }

  /** @param {number[][] | null} corners Of a panel, if there is one. */
  showCorners(corners) {
    this.showOutlines(corners ? [corners] : []);
  }

  /** @param {number[][][]} panels The corners of each. */
  showOutlines(panels) {
    const { children } = this.outline;
    while (children.length > panels.length) children[panels.length].remove();
    while (children.length < panels.length) this.outline.append(document.createElementNS("http://www.w3.org/2000/svg", "polygon"));
    panels.forEach((corners, at) => children[at].setAttribute("points", Picture.outlineOf(corners)));
  }

  /**
   * The outline through the middles of the corner LEDs, a little outside of them.
   * @param {number[][]} corners Pixels' middles are at whole numbers.
   */
  static outlineOf(corners) {
    const middle = [0, 1].map((axis) => corners.reduce((sum, corner) => sum + corner[axis], 0) / corners.length);
    // Half a pitch and a bit: the corners are middles of LEDs, seven pitches apart.
    const grown = corners.map((corner) => [0, 1].map((axis) => middle[axis] + (corner[axis] - middle[axis]) * 1.16 + 0.5).join(","));
    return grown.join(" ");
  }

  /** @param {string} text What the picture shows now. */
  describe(text) {
    this.canvas.setAttribute("aria-label", `${this.name}: ${text}`);
  }
}
