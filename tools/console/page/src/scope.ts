// A triggered scope: up to 16 quantities of every tick, from before the trigger on.
import type {Telemetry, Vector} from './wire';

export interface ScopeColours { line: string; axis: string; grid: string; mark: string }
interface Channel { name: string; unit: string; of: (t: Telemetry) => number; steps?: boolean }

const kCapacity = 1 << 16, kMost = 16;
const kLabel = 0.45;  // of the width at most, where labels stand beside the curves
const kWindows_s = [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5], kBefore = [0.1, 0.5, 0.9];
const norm = (v?: Vector) => (v ? Math.hypot(v.x, v.y, v.z) : 0);
const of3 = (name: string, unit: string, scale: number, of: (t: Telemetry) => Vector | undefined): Channel[] =>
  (['x', 'y', 'z'] as const).map((axis) => ({name: `${name} ${axis}`, unit, of: (t) => (of(t)?.[axis] ?? 0) * scale}));
const bit = (name: string, n: number, of: (t: Telemetry) => number): Channel => ({name, unit: '', steps: true, of: (t) => (of(t) >> n) & 1});

function channels(effects: string[]): Channel[] {
  return [
    {name: 'hand force', unit: 'N', of: (t) => norm(t.force_N)},
    {name: 'needle force', unit: 'µN', of: (t) => t.tip_force_N * 1e6},
    {name: 'depth', unit: 'µm', of: (t) => t.wd_m * 1e6},
    {name: 'hand speed', unit: 'mm/s', of: (t) => norm(t.v_m_s) * 1e3},
    ...of3('needle', 'µm', 1e6, (t) => t.tip_m),
    {name: 'phase', unit: '', steps: true, of: (t) => t.phase},
    ...of3('set-point', 'µm', 1e6, (t) => t.cmd_m),
    ...of3('hand', 'mm', 1e3, (t) => t.x_m),
    ...of3('hand force', 'N', 1, (t) => t.force_N),
    ...effects.map((name, i): Channel => ({name: `effect ${name.replaceAll('_', ' ')}`, unit: 'N', of: (t) => t.effect_N[i] ?? 0})),
    {name: 'passivity guard', unit: 'N', of: (t) => t.guard_N},
    {name: 'half-width of the dimple', unit: 'µm', of: (t) => t.a_m * 1e6},
    {name: 'radius at rest', unit: 'µm', of: (t) => t.R_m * 1e6},
    {name: 'pressure', unit: 'Pa', of: (t) => t.pressure_Pa},
    {name: 'gap seen', unit: 'µm', of: (t) => t.obs_gap_m * 1e6},
    {name: 'age of vision', unit: 'ms', of: (t) => t.obs_age_s * 1e3},
    {name: 'force sensor', unit: 'µN', of: (t) => t.sensor_N * 1e6},
    {name: 'vacuum', unit: 'Pa', of: (t) => t.vacuum_Pa},
    {name: 'injected energy', unit: 'mJ', of: (t) => t.injected_energy_J * 1e3},
    {name: 'stop', unit: '', steps: true, of: (t) => t.stop},
    bit('clutch', 0, (t) => t.buttons), bit('inject button', 1, (t) => t.buttons), bit('enable', 3, (t) => t.buttons),
    {name: 'injector open', unit: '', steps: true, of: (t) => Number(t.injector_open)},
  ];
}

// As a link has it.
const plain = (name: string) => name.replaceAll(' ', '-');

type Edge = 'rises' | 'falls' | 'changes';
interface Shown { times: Float64Array; ticks: Float64Array; columns: Float64Array[]; begin_s: number; length_s: number; zero_s: number }

export class Scope {
  chosen = [0, 1, 2, 3, 4, 7];
  lost = 0;
  shown?: Shown;
  triggered?: number;  // s of the run
  private all: Channel[] = [];
  private times = new Float64Array(kCapacity);
  private ticks = new Float64Array(kCapacity);
  private columns: Float64Array[] = [];
  private count = 0;   // samples so far
  private from = 0;    // of the same run and without a jump back
  private at = -1;     // sample of the trigger
  private held = false;
  private left = 0;   // where the curves begin, in pixels
  private wantedChannels: string[] = [];
  private wantedSource = 'needle-force';  // both of a link, until it is known what there is
  private cursor = -1;  // sample of what is shown
  private dirty = true;
  private source: HTMLSelectElement; private edge: HTMLSelectElement; private level: HTMLInputElement;
  private window: HTMLSelectElement; private before: HTMLSelectElement; private mode: HTMLSelectElement;
  private arm: HTMLButtonElement; private list: HTMLElement; private note: HTMLElement; private canvas: HTMLCanvasElement;

  constructor(parent: HTMLElement, private colours: ScopeColours) {
    const select = (label: string, options: [string, string][], chosen: string) => {
      const made = document.createElement('select');
      made.setAttribute('aria-label', label);
      made.title = label;
      made.append(...options.map(([value, text]) => new Option(text, value, value === chosen, value === chosen)));
      made.addEventListener('change', () => this.begin());
      return made;
    };
    const button = (text: string, act: () => void) => {
      const made = document.createElement('button');
      made.textContent = text;
      made.addEventListener('click', act);
      return made;
    };
    this.mode = select('when it shows', [['free', 'always'], ['normal', 'each time that'], ['single', 'once when']], 'free');
    this.source = select('quantity of the trigger', [], '');
    this.edge = select('edge of the trigger', [['rises', 'rises above'], ['falls', 'falls below'], ['changes', 'changes']], 'rises');
    this.level = document.createElement('input');
    this.level.value = '0';
    this.level.inputMode = 'decimal';
    this.level.setAttribute('aria-label', 'level of the trigger');
    this.level.addEventListener('change', () => this.begin());
    this.level.addEventListener('keydown', (event) => { if (event.key !== 'Escape') event.stopPropagation(); });
    this.window = select('length', kWindows_s.map((s) => [String(s), s < 1 ? `${s * 1e3} ms` : `${s} s`]), '1');
    this.before = select('part before the trigger', kBefore.map((b) => [String(b), `${b * 100} % before`]), '0.1');
    this.arm = button('Again', () => this.begin());
    this.note = document.createElement('span');
    this.note.setAttribute('role', 'status');
    this.list = document.createElement('div');
    this.list.id = 'scope-list';
    this.list.popover = 'auto';
    const which = button('Quantities', () => {});
    which.popoverTargetElement = this.list;
    const row = document.createElement('p');
    row.append(this.mode, this.source, this.edge, this.level, this.window, this.before, this.arm, button('Save as CSV', () => this.save()), which, this.note);
    this.canvas = document.createElement('canvas');
    this.canvas.tabIndex = 0;
    this.canvas.addEventListener('pointermove', (event) => this.point(event.offsetX));
    parent.append(row, this.list, this.canvas);
    new ResizeObserver(() => { this.dirty = true; }).observe(this.canvas);
  }

  // What can be shown; the names of the effects come from the station.
  know(effects: string[]): void {
    if (this.all.length > 0) return;
    this.all = channels(effects);
    this.columns = this.all.map(() => new Float64Array(kCapacity));
    const index = (name: string) => this.all.findIndex((c) => plain(c.name) === name), found = index(this.wantedSource), source = found < 0 ? 1 : found;
    this.source.replaceChildren(...this.all.map((c, i) => new Option(c.name, String(i), i === source, i === source)));
    const wanted = this.wantedChannels.map(index).filter((i) => i >= 0).slice(0, kMost).sort((a, b) => a - b);
    if (wanted.length > 0) this.chosen = wanted;
    this.list.replaceChildren(...this.all.map((c, i) => {
      const label = document.createElement('label'), box = document.createElement('input');
      box.type = 'checkbox';
      box.checked = this.chosen.includes(i);
      box.addEventListener('change', () => {
        this.chosen = box.checked ? [...this.chosen, i].sort((a, b) => a - b) : this.chosen.filter((one) => one !== i);
        this.full();
        this.dirty = true;
      });
      label.append(box, ` ${c.name}${c.unit ? ` [${c.unit}]` : ''}`);
      return label;
    }));
    this.full();
  }
  private full(): void {
    for (const other of this.list.querySelectorAll('input')) other.disabled = !other.checked && this.chosen.length >= kMost;
  }

  // It waits for its trigger, or fills what it shows after it.
  get holds(): boolean { return this.mode.value !== 'free' && this.held; }
  get armed(): boolean { return this.mode.value !== 'free' && !this.held; }
  // What is set up, as a link has it: the quantities; when, of what, edge, level, length, part before.
  get channels(): string { return this.all.length > 0 ? this.chosen.map((i) => plain(this.all[i]!.name)).join('_') : this.wantedChannels.join('_'); }
  get setUp(): string {
    const source = this.all.length > 0 ? plain(this.all[Number(this.source.value)]!.name) : this.wantedSource;
    return [this.mode.value, source, this.edge.value, this.threshold(), this.window.value, this.before.value].join('_');
  }
  restore(channels: string, setUp: string): void {
    const [mode, source, edge, level, window, before] = setUp.split('_');
    this.wantedChannels = channels.split('_');
    this.wantedSource = source || this.wantedSource;
    if (level !== undefined && Number.isFinite(Number(level))) this.level.value = level;
    for (const [element, value] of [[this.mode, mode], [this.edge, edge], [this.window, window], [this.before, before]] as const) {
      if ([...element.options].some((o) => o.value === value)) element.value = value!;
    }
  }

  add(samples: Telemetry[], lost: number): void {
    this.lost = lost;
    for (const t of samples) {
      const i = this.count % kCapacity, last = (this.count + kCapacity - 1) % kCapacity;
      if (this.count > this.from && t.tick <= this.ticks[last]!) this.begin(true);  // another run, or a recording that was turned back
      this.times[i] = t.t_s;
      this.ticks[i] = t.tick;
      this.all.forEach((c, k) => { this.columns[k]![i] = c.of(t); });
      if (this.count > this.from && this.at < 0 && this.mode.value !== 'free' && !this.held && this.fires(last, i)) this.at = this.count;
      this.count++;
      if (this.at >= 0) this.finish();
    }
  }

  private get window_s(): number { return Number(this.window.value); }
  private get before_s(): number { return Number(this.before.value) * this.window_s; }

  private fires(last: number, now: number): boolean {
    const column = this.columns[Number(this.source.value)]!, a = column[last]!, b = column[now]!, level = this.threshold();
    const edge = this.edge.value as Edge;
    return edge === 'changes' ? a !== b : edge === 'rises' ? a < level && b >= level : a > level && b <= level;
  }
  private threshold(): number { return Number(this.level.value.replace(',', '.')); }

  // Another look; what is shown stays until there is something new.
  private begin(fresh = false): void {
    if (fresh) this.from = this.count;
    this.at = -1;
    this.held = false;
    this.triggered = undefined;
    this.dirty = true;
  }

  private finish(): void {
    const zero = this.times[this.at % kCapacity]!, end = zero - this.before_s + this.window_s;
    if (this.times[(this.count - 1) % kCapacity]! < end) return;
    this.take(zero - this.before_s, end, zero);
    this.triggered = zero;
    this.at = -1;
    this.held = this.mode.value === 'single';
  }

  private take(begin_s: number, end_s: number, zero_s: number): void {
    const first = Math.max(this.from, this.count - kCapacity + 1, 0);
    let a = this.count, b = this.count;
    while (a > first && this.times[(a - 1) % kCapacity]! >= begin_s) a--;
    while (b > a && this.times[(b - 1) % kCapacity]! > end_s) b--;
    const part = (column: Float64Array) => Float64Array.from({length: b - a}, (_, k) => column[(a + k) % kCapacity]!);
    this.shown = {times: part(this.times), ticks: part(this.ticks), columns: this.columns.map(part), begin_s, length_s: end_s - begin_s, zero_s};
    this.cursor = Math.min(this.cursor, b - a - 1);
    this.dirty = true;
  }

  private point(x: number): void {
    if (!this.shown) return;
    const part = Math.min(Math.max((x - this.left) / (this.canvas.clientWidth - this.left), 0), 1), n = this.shown.times.length;
    const at = this.shown.begin_s + part * this.shown.length_s;
    let i = 0;
    while (i < n - 1 && this.shown.times[i]! < at) i++;
    this.cursor = i;
    this.dirty = true;
  }
  moveCursor(by: number): void {
    if (!this.shown) return;
    const n = this.shown.times.length, from = this.cursor < 0 ? n - 1 : this.cursor;
    this.cursor = Math.min(Math.max(from + by, 0), n - 1);
    this.dirty = true;
  }
  // Where the cursor is: seconds of the run and the values of what is chosen.
  read(): {t_s: number; values: Record<string, number>} | undefined {
    if (!this.shown || this.cursor < 0) return undefined;
    return {t_s: this.shown.times[this.cursor]!, values: Object.fromEntries(this.chosen.map((c) => [this.all[c]!.name, this.shown!.columns[c]![this.cursor]!]))};
  }

  paint(colours: ScopeColours): void {
    this.colours = colours;
    this.dirty = true;
  }

  csv(): string {
    const s = this.shown;
    if (!s) return '';
    const head = ['tick', 't_s', ...this.chosen.map((c) => `${this.all[c]!.name}${this.all[c]!.unit ? ` [${this.all[c]!.unit}]` : ''}`)];
    const rows = Array.from(s.times, (t, i) => [s.ticks[i], t, ...this.chosen.map((c) => s.columns[c]![i])].join());
    return [head.join(), ...rows].join('\n') + '\n';
  }
  private save(): void {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([this.csv()], {type: 'text/csv'}));
    link.download = 'scope.csv';
    link.click();
    URL.revokeObjectURL(link.href);
  }

  // Some times a second, while it is seen.
  draw(): void {
    if (this.all.length === 0) return;
    const free = this.mode.value === 'free';
    for (const one of [this.source, this.edge, this.before, this.arm]) one.hidden = free;
    this.level.hidden = free || this.edge.value === 'changes';
    this.level.setAttribute('aria-invalid', String(!Number.isFinite(this.threshold())));
    if (free && this.count > this.from) {
      const end = this.times[(this.count - 1) % kCapacity]!;
      if (end !== this.shown?.zero_s) this.take(end - this.window_s, end, end);
    }
    const note = [
      free ? '' : this.triggered !== undefined ? `at ${this.triggered.toFixed(3)} s` : this.at >= 0 ? 'fills' : 'waits',
      this.held ? 'holds' : '', this.shown ? `${this.shown.times.length} ticks` : '', this.lost > 0 ? `${this.lost} ticks lost` : '',
      Number.isFinite(this.threshold()) ? '' : 'the level is no number',
    ].filter(Boolean).join(', ');
    if (this.note.textContent !== note) this.note.textContent = note;
    if (!this.dirty || this.canvas.clientWidth === 0) return;
    this.dirty = false;
    const ratio = devicePixelRatio, width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    const c = this.canvas.getContext('2d')!;
    c.scale(ratio, ratio);
    const font = Math.round(0.83 * parseFloat(getComputedStyle(document.body).fontSize)), foot = Math.round(1.4 * font);
    c.font = `${font}px system-ui, sans-serif`;
    const lane = (height - foot) / Math.max(this.chosen.length, 1), s = this.shown;
    const begin = s?.begin_s ?? 0, length = s?.length_s ?? this.window_s, left = s ? s.zero_s - begin : 0;
    const rows = this.chosen.map((which) => this.row(which, s)), above = lane > 2.4 * font;
    this.left = above ? 0 : Math.min(24 * Math.ceil((Math.max(...rows.map((row) => c.measureText(row.short).width), 0) + 12) / 24), kLabel * width);
    const x = (t: number) => this.left + ((t - begin) / length) * (width - this.left);
    c.strokeStyle = this.colours.grid;
    c.fillStyle = this.colours.axis;
    for (let k = 0; k <= 10; k++) {
      const at = this.left + (k / 10) * (width - this.left);
      c.beginPath();
      c.moveTo(at, 0);
      c.lineTo(at, height - foot);
      c.stroke();
      c.textAlign = k === 0 ? 'left' : k === 10 ? 'right' : 'center';
      if (k % (width - this.left > 560 ? 2 : width - this.left > 260 ? 5 : 10) === 0) c.fillText(`${(((k / 10) * length - left) * 1e3).toFixed(0)} ms`, at, height - 5);
    }
    c.textAlign = 'left';
    this.chosen.forEach((which, row) => {
      const channel = this.all[which]!, top = row * lane;
      c.strokeStyle = this.colours.grid;
      c.beginPath();
      c.moveTo(0, top + lane);
      c.lineTo(width, top + lane);
      c.stroke();
      const {column, low, high, short, range} = rows[row]!, text = above ? font + 2 : 0, room = lane - text - 4, span = high > low ? high - low : 1;
      const y = (v: number) => top + text + 2 + room * (high > low ? 1 - (v - low) / span : 0.5);
      if (s) this.trace(c, s, column, x, y, width - this.left, channel.steps ?? false);
      c.fillStyle = this.colours.axis;
      if (above) c.fillText(`${short}   ${range}`, 4, top + font);
      else c.fillText(short, 4, top + lane / 2 + 0.35 * font, this.left - 8);
    });
    c.strokeStyle = this.colours.mark;
    const line = (at: number, dash: number[]) => {
      c.setLineDash(dash);
      c.beginPath();
      c.moveTo(at, 0);
      c.lineTo(at, height - foot);
      c.stroke();
    };
    if (s && !free) line(x(s.zero_s), [4, 4]);
    if (s && this.cursor >= 0 && this.cursor < s.times.length) line(x(s.times[this.cursor]!), []);
    c.setLineDash([]);
  }

  private row(which: number, s?: Shown): {column: Float64Array; low: number; high: number; short: string; range: string} {
    const channel = this.all[which]!, column = s?.columns[which] ?? new Float64Array();
    let low = Infinity, high = -Infinity;
    for (const v of column) {
      if (v < low) low = v;
      if (v > high) high = v;
    }
    const digits = Math.max(0, Math.min(4, 3 - Math.floor(Math.log10(Math.max(Math.abs(low), Math.abs(high), 1e-3)))));
    const number = (v: number) => (Number.isFinite(v) ? v.toFixed(channel.steps ? 0 : digits) : '–');
    const read = this.cursor >= 0 && column.length > this.cursor ? column[this.cursor]! : column.at(-1) ?? NaN;
    return {column, low, high, short: `${channel.name}: ${number(read)} ${channel.unit}`, range: `(${number(low)} to ${number(high)})`};
  }

  // Of each column of the screen the lowest and the highest: no peak is lost. A tick that is missing is a gap.
  private trace(c: CanvasRenderingContext2D, s: Shown, column: Float64Array, x: (t: number) => number, y: (v: number) => number, width: number, steps: boolean): void {
    c.strokeStyle = this.colours.line;
    c.lineWidth = 1.5;
    c.beginPath();
    const dense = column.length > 2 * width;
    let before = 0;
    for (let i = 0; i < column.length;) {
      const gap = i > 0 && s.ticks[i]! !== s.ticks[i - 1]! + 1;
      const at = x(s.times[i]!);
      if (i === 0 || gap) c.moveTo(at, y(column[i]!));
      else if (steps) c.lineTo(at, y(before));
      if (!dense) {
        before = column[i]!;
        c.lineTo(at, y(before));
        i++;
        continue;
      }
      let low = column[i]!, high = low, j = i;
      for (; j < column.length && Math.floor(x(s.times[j]!)) === Math.floor(at); j++) {
        low = Math.min(low, column[j]!);
        high = Math.max(high, column[j]!);
      }
      before = column[j - 1]!;
      c.lineTo(at, y(low));
      c.lineTo(at, y(high));
      c.lineTo(at, y(before));
      i = Math.max(j, i + 1);
    }
    c.stroke();
    c.lineWidth = 1;
  }
}
