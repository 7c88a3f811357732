// Force, depth and velocity over time, with a cursor that reads values while they come.
import uPlot from 'uplot';
import type {Telemetry} from './wire';

const kWindow_s = 30, kPoints = 1200, kMost = 20000;

interface Series { label: string; unit: string; digits: number; of: (t: Telemetry) => number }
const norm = (v?: {x: number; y: number; z: number}) => (v ? Math.hypot(v.x, v.y, v.z) : 0);
const kCharts: Series[][] = [
  [{label: 'hand force', unit: 'N', digits: 3, of: (t) => norm(t.force_N)}],
  [
    {label: 'depth', unit: 'µm', digits: 1, of: (t) => t.wd_m * 1e6},
    {label: 'needle force', unit: 'µN', digits: 2, of: (t) => t.tip_force_N * 1e6},
  ],
  [{label: 'hand velocity', unit: 'mm/s', digits: 1, of: (t) => norm(t.v_m_s) * 1e3}],
];
const kSeries = kCharts.flat();
const kFoot_px = 26, kSide_px = 52;  // for the numbers of the axes

// The smallest and the largest of each of so many parts of the time: no peak is lost.
export function decimate(times: number[], columns: number[][], points: number): number[][] {
  const n = times.length;
  if (n <= points) return [times, ...columns];
  const parts = Math.floor(points / 2), out: number[][] = [[], ...columns.map(() => [])];
  for (let p = 0; p < parts; p++) {
    const from = Math.floor((p * n) / parts), to = Math.floor(((p + 1) * n) / parts);
    if (to <= from) continue;
    out[0]!.push(times[from]!, times[to - 1]!);
    columns.forEach((column, c) => {
      let low = Infinity, high = -Infinity, lowAt = from, highAt = from;
      for (let i = from; i < to; i++) {
        if (column[i]! < low) { low = column[i]!; lowAt = i; }
        if (column[i]! > high) { high = column[i]!; highAt = i; }
      }
      out[c + 1]!.push(...(lowAt <= highAt ? [low, high] : [high, low]));
    });
  }
  return out;
}

export interface PlotColours { line: string[]; axis: string; grid: string }

export class Plots {
  readonly drawn = {points: 0};
  private times: number[] = [];
  private columns: number[][] = kSeries.map(() => []);
  private plots: uPlot[] = [];
  private frozen = false;

  constructor(private parent: HTMLElement, private colours: PlotColours) {
    this.make();
    new ResizeObserver(() => this.size()).observe(parent);
  }

  add(t: Telemetry): void {
    if (this.times.length > 0 && t.t_s < this.times[this.times.length - 1]!) this.clear();  // another run
    this.times.push(t.t_s);
    kSeries.forEach((series, i) => this.columns[i]!.push(series.of(t)));
    if (this.times.length > kMost) {
      for (const column of [this.times, ...this.columns]) column.splice(0, kMost / 4);
    }
  }

  freeze(on: boolean): void { this.frozen = on; }

  // A step to the left or to the right, in pixels.
  moveCursor(by: number): void {
    const first = this.plots[0]!, width = first.over.clientWidth;
    const from = first.cursor.left !== undefined && first.cursor.left >= 0 ? first.cursor.left : width;
    for (const plot of this.plots) plot.setCursor({left: Math.min(Math.max(from + by, 0), width), top: 5});
  }

  paint(colours: PlotColours): void {
    this.colours = colours;
    this.make();
  }

  draw(): void {
    if (this.frozen || this.times.length === 0) return;
    const end = this.times[this.times.length - 1]!;
    let first = this.times.findIndex((t) => t >= end - kWindow_s);
    if (first < 0) first = 0;
    const [times, ...columns] = decimate(this.times.slice(first), this.columns.map((c) => c.slice(first)), kPoints);
    this.drawn.points = times!.length;
    let at = 0;
    this.plots.forEach((plot, i) => {
      const n = kCharts[i]!.length;
      plot.setData([times!, ...columns.slice(at, at + n)]);
      at += n;
    });
  }

  private clear(): void {
    for (const column of [this.times, ...this.columns]) column.length = 0;
  }

  private size(): void {
    this.plots.forEach((plot, i) => plot.setSize(this.room(i)));
  }

  // The lowest alone has the time at its foot.
  private room(chart: number): {width: number; height: number} {
    const legend = this.parent.querySelector<HTMLElement>('.u-legend')?.clientHeight || 26;
    const all = this.parent.clientHeight - kCharts.length * legend - kFoot_px;
    return {
      width: Math.max(this.parent.clientWidth, 120),
      height: Math.max(Math.floor(all / kCharts.length), 28) + (chart === kCharts.length - 1 ? kFoot_px : 0),
    };
  }

  private make(): void {
    for (const plot of this.plots) plot.destroy();
    const axis = {stroke: this.colours.axis, grid: {stroke: this.colours.grid, width: 1}, ticks: {stroke: this.colours.grid, width: 1}, font: '14px system-ui, sans-serif'};
    // Without a cursor the newest value is read.
    const value = (digits: number) => (plot: uPlot, v: number | null, series: number) => {
      const read = v ?? plot.data[series]?.at(-1);
      return read === null || read === undefined ? '–' : read.toFixed(digits);
    };
    this.plots = kCharts.map((series, chart) => new uPlot({
      ...this.room(chart),
      padding: [8, series.length > 1 ? 0 : kSide_px, 4, 0],
      cursor: {sync: {key: 'time'}, drag: {x: false, y: false}},
      scales: {x: {time: false}},
      axes: [
        chart === kCharts.length - 1 ? {...axis, size: kFoot_px} : {...axis, size: 0, values: () => []},
        {...axis, size: kSide_px, space: 24},
        ...(series.length > 1 ? [{...axis, size: kSide_px, space: 24, side: 1 as const, scale: series[1]!.unit, grid: {show: false}}] : []),
      ],
      series: [
        {label: 'time [s]', value: value(2)},
        ...series.map((one, k) => ({
          label: `${one.label} [${one.unit}]`,
          scale: k === 0 ? 'y' : one.unit,
          stroke: this.colours.line[k],
          width: 2,
          dash: k === 0 ? undefined : [6, 4],
          value: value(one.digits),
        })),
      ],
    }, [[], ...series.map(() => [])] as uPlot.AlignedData, this.parent));
    this.size();
  }
}
