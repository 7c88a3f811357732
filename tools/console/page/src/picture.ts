// The microscope's picture as vision looked at it, with what it found there.
import type {Observation, Picture, Vector} from './wire';

export interface PictureColours { background: string; text: string; outer: string; inner: string; needle: string; holder: string; mark: string }

const kObservations = 32, kOld_ms = 1000, kSigmas = 2, kWait_ms = 150, kAcross_m = 20e-6;

export class LivePicture {
  readonly drawn: {frame: number; found: boolean; tip?: [number, number]; pixel?: number} = {frame: -1, found: false};  // tip: where on the canvas; pixel: of it, for a metre
  private grey = document.createElement('canvas');
  private picture?: Picture;
  private at = -Infinity;
  private next?: Picture;  // until what was found in it has come
  private nextAt = 0;
  private observations = new Map<number, Observation>();
  private dirty = true;
  private wasOld = false;
  private depthOf?: (x: number, y: number) => number;
  private limit_m?: number;
  private target_m?: number;

  constructor(private canvas: HTMLCanvasElement, private colours: PictureColours) {
    new ResizeObserver(() => { this.dirty = true; }).observe(canvas);
  }

  paint(colours: PictureColours): void {
    this.colours = colours;
    this.dirty = true;
  }

  observation(o: Observation): void {
    this.observations.set(o.frame, o);
    if (this.observations.size > kObservations) this.observations.delete(this.observations.keys().next().value!);
    if (o.frame === this.picture?.frame) this.dirty = true;
    if (this.next?.frame === o.frame) this.show(this.next);
  }

  take(p: Picture): void {
    if (p.width * p.height !== p.grey.length || p.grey.length === 0) throw new Error('a picture of another size than it says');
    this.next = p;
    this.nextAt = performance.now();
    if (this.observations.has(p.frame)) this.show(p);
  }

  private show(p: Picture): void {
    const {width, height, grey} = p;
    this.picture = p;
    this.next = undefined;
    this.at = performance.now();
    this.dirty = true;
    this.grey.width = width;
    this.grey.height = height;
    const pixels = new ImageData(width, height), out = new Uint32Array(pixels.data.buffer);
    for (let i = 0; i < grey.length; i++) out[i] = 0xff000000 | (grey[i]! * 0x010101);
    this.grey.getContext('2d')!.putImageData(pixels, 0, 0);
  }

  // Past the undeformed membrane: how deep the needle may go, and what is asked for.
  depths(limit_m?: number, target_m?: number): void {
    if (limit_m !== this.limit_m || target_m !== this.target_m) this.dirty = true;
    this.limit_m = limit_m;
    this.target_m = target_m;
  }
  // Along the needle's axis past the undeformed membrane, at a place on the canvas; NaN: not known.
  depthAt(x: number, y: number): number { return this.wasOld ? NaN : this.depthOf?.(x, y) ?? NaN; }

  // Some times a second, while it is seen. still: it is a recording that stands still.
  draw(still: boolean): void {
    if (this.next && performance.now() - this.nextAt > kWait_ms) this.show(this.next);
    const old = !still && performance.now() - this.at > kOld_ms;
    if (old !== this.wasOld) this.dirty = true;
    this.wasOld = old;
    if (this.canvas.clientWidth === 0 || !this.dirty) return;
    this.dirty = false;
    const ratio = devicePixelRatio, wide = this.canvas.clientWidth, high = this.canvas.clientHeight;
    this.canvas.width = wide * ratio;
    this.canvas.height = high * ratio;
    const c = this.canvas.getContext('2d')!;
    c.scale(ratio, ratio);
    c.fillStyle = this.colours.background;
    c.fillRect(0, 0, wide, high);
    const font = Math.round(0.83 * parseFloat(getComputedStyle(document.body).fontSize)), head = Math.round(3.2 * font);
    c.font = `${font}px system-ui, sans-serif`;
    const p = this.picture, lines: string[] = [];
    if (!p) {
      c.fillStyle = this.colours.text;
      c.fillText('No picture has come: vision tells one where it looks at pictures.', 12, 1.3 * font, wide - 24);
      return;
    }
    const scale = Math.min(wide / p.width, (high - head) / p.height), left = (wide - p.width * scale) / 2, top = head;
    if (old) c.filter = 'grayscale(1) opacity(.5)';
    c.imageSmoothingEnabled = scale < 2;
    c.drawImage(this.grey, left, top, p.width * scale, p.height * scale);
    c.filter = 'none';
    const step = p.step_px || 1, x = (px: number) => left + ((px + 0.5) / step) * scale, y = (px: number) => top + ((px + 0.5) / step) * scale;
    const middle = [(p.width * step - 1) / 2, (p.height * step - 1) / 2] as const;
    const place = (v: Vector): [number, number] => [x(v.x / p.pixel_m + middle[0]), y(v.y / p.pixel_m + middle[1])];
    this.contour(c, p.outer, this.colours.outer, [], x, y);
    this.contour(c, p.inner, this.colours.inner, [6, 4], x, y);
    const o = this.observations.get(p.frame);
    this.drawn.frame = p.frame;
    this.drawn.found = o !== undefined;
    this.depthOf = this.drawn.tip = undefined;
    if (o) {
      const pixel = this.drawn.pixel = scale / step / p.pixel_m;
      if (o.tip_ok && o.tip_m && o.axis) {
        const [tx, ty] = this.drawn.tip = place(o.tip_m);
        this.stroke(c, this.colours.needle, [[tx - 5, ty], [tx + 5, ty]]);
        this.stroke(c, this.colours.needle, [[tx, ty - 5], [tx, ty + 5]]);
        this.stroke(c, this.colours.needle, [[tx, ty], [tx - 60e-6 * pixel * o.axis.x, ty - 60e-6 * pixel * o.axis.y]]);
        if (o.entry_m && o.outer_ok) {
          const [ex, ey] = place(o.entry_m), {x: ax, y: ay} = o.axis;
          this.depthOf = (sx, sy) => ((sx - ex) * ax + (sy - ey) * ay) / pixel;
          const across = (depth_m: number, dash: number[]) => {
            const [mx, my] = [ex + depth_m * pixel * ax, ey + depth_m * pixel * ay], half = kAcross_m * pixel;
            c.setLineDash(dash);
            this.stroke(c, this.colours.mark, [[mx - half * ay, my + half * ax], [mx + half * ay, my - half * ax]]);
            c.setLineDash([]);
          };
          if (this.limit_m !== undefined) across(this.limit_m, []);
          if (this.target_m !== undefined) across(this.target_m, [5, 5]);
          if (o.wd_m > 0) this.stroke(c, this.colours.mark, [[ex, ey], [ex + o.wd_m * pixel * o.axis.x, ey + o.wd_m * pixel * o.axis.y]]);
        }
      }
      if (o.holder_ok && o.holder_m) {
        const [hx, hy] = place(o.holder_m);
        this.stroke(c, this.colours.holder, [[hx, hy - 12], [hx, hy + 12]]);
      }
      const um = (name: string, value: number, sd: number) => `${name} ${(value * 1e6).toFixed(1)}${sd > 0 ? ` ± ${(kSigmas * sd * 1e6).toFixed(1)}` : ''}`;
      const missing = [['holder', o.holder_ok], ['needle', o.tip_ok], ['outer membrane', o.outer_ok], ['inner membrane', o.inner_ok]]
        .filter(([, ok]) => !ok).map(([name]) => name);
      lines[0] = [`frame ${p.frame}`, o.contact ? 'contact' : '', o.punctured ? 'punctured' : '', missing.length > 0 ? `not found: ${missing.join(', ')}` : ''].filter(Boolean).join(', ');
      lines[1] = `${[um('radius', o.R_m, o.R_sd_m), um('gap', o.gap_m, o.noise_m), um('depth', o.wd_m, o.wd_sd_m), um('half-width', o.a_m, o.a_sd_m)].join(', ')} µm`;
    }
    lines[0] = `${old ? 'OLD PICTURE: ' : ''}${lines[0] ?? `frame ${p.frame}`}`;
    c.fillStyle = this.colours.text;
    lines.forEach((line, i) => c.fillText(line, 12, 1.3 * font * (i + 1), wide - 24));
  }

  // With a bar of two standard deviations to either side at each point that has one.
  private contour(c: CanvasRenderingContext2D, contour: Picture['outer'], colour: string, dash: number[], x: (px: number) => number, y: (px: number) => number): void {
    if (!contour || contour.x_px.length < 3) return;
    const n = contour.x_px.length, at = (i: number): [number, number] => [x(contour.x_px[(i + n) % n]!), y(contour.y_px[(i + n) % n]!)];
    c.setLineDash(dash);
    this.stroke(c, colour, [...Array.from({length: n}, (_, i) => at(i)), at(0)]);
    c.setLineDash([]);
    for (let i = 0; i < n; i++) {
      const sd = contour.sd_px[i] ?? 0, [ax, ay] = at(i - 1), [bx, by] = at(i + 1), long = Math.hypot(bx - ax, by - ay);
      if (!(sd > 0) || !(long > 0)) continue;
      const [px, py] = at(i), reach = (kSigmas * sd * (x(1) - x(0))) / long, nx = (by - ay) * reach, ny = (ax - bx) * reach;
      this.stroke(c, colour, [[px - nx, py - ny], [px + nx, py + ny]]);
    }
  }
  private stroke(c: CanvasRenderingContext2D, colour: string, points: [number, number][]): void {
    c.beginPath();
    points.forEach(([px, py], i) => (i === 0 ? c.moveTo(px, py) : c.lineTo(px, py)));
    for (const [style, width] of [['#000', 4], [colour, 2]] as const) {
      c.strokeStyle = style;
      c.lineWidth = width;
      c.stroke();
    }
  }
}
