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
const kLow_px = 60, kLowest_px = 28;  // lower than this the legend lies on the curves; lower than that the charts scroll
const kGap_s = 0.15;  // of real time: as long without a sample is no curve

type Column = (number | null)[];  // null: a gap
// The smallest and the largest of each of so many parts of the time: no peak is lost, and no gap.
export function decimate(times: number[], columns: Column[], points: number): [number[], ...Column[]] {
  const n = times.length;
  if (n <= points) return [times, ...columns];
  const parts = Math.floor(points / 2), outTimes: number[] = [], out = columns.map((): Column => []);
  for (let p = 0; p < parts; p++) {
    const end = Math.floor(((p + 1) * n) / parts);
    for (let from = Math.floor((p * n) / parts), to = from; from < end; from = to) {
      const gap = columns[0]![from] === null;
      while (to < end && (columns[0]![to] === null) === gap) to++;
      outTimes.push(times[from]!, times[to - 1]!);
      columns.forEach((column, c) => {
        let low = Infinity, high = -Infinity, lowAt = from, highAt = from;
        for (let i = from; i < to && !gap; i++) {
          if (column[i]! < low) { low = column[i]!; lowAt = i; }
          if (column[i]! > high) { high = column[i]!; highAt = i; }
        }
        out[c]!.push(...(gap ? [null, null] : lowAt <= highAt ? [low, high] : [high, low]));
      });
    }
  }
  return [outTimes, ...out];
}

export interface PlotColours { line: string[]; axis: string; grid: string }

export class Plots {
  readonly drawn = {points: 0, gaps: 0};
  private times: number[] = [];
  private columns: Column[] = kSeries.map(() => []);
  private plots: uPlot[] = [];
  private frozen = false;
  private resized = new ResizeObserver(() => this.size());

  constructor(private parent: HTMLElement, private colours: PlotColours) {
    this.make();
    this.resized.observe(parent);
  }

  // speed: of a recording that is played; else 1.
  add(t: Telemetry, speed: number): void {
    const before_s = this.times.at(-1) ?? t.t_s;
    if (t.t_s < before_s) this.clear();  // another run, or a recording that was turned back
    else if (t.t_s - before_s > kGap_s * Math.max(speed, 0.1)) {
      this.times.push((before_s + t.t_s) / 2);
      for (const column of this.columns) column.push(null);
    }
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
    this.drawn.points = times.length;
    this.drawn.gaps = columns[0]!.filter((v, i, all) => v === null && all[i - 1] !== null).length;
    let at = 0;
    this.plots.forEach((plot, i) => {
      const n = kCharts[i]!.length;
      plot.setData([times, ...columns.slice(at, at + n)]);
      at += n;
    });
  }

  private clear(): void {
    for (const column of [this.times, ...this.columns]) column.length = 0;
  }

  // The lowest alone has the time at its foot. How many lines a legend has follows from the width.
  private size(): void {
    const width = this.parent.clientWidth, high = this.parent.clientHeight;
    if (width === 0 || high === 0) return;  // another panel has the place
    for (const plot of this.plots) plot.root.style.width = `${width}px`;
    const part = (legends: number) => Math.floor((high - kFoot_px - legends) / kCharts.length);
    this.parent.classList.remove('low');
    let height = part(this.plots.reduce((sum, plot) => sum + plot.root.querySelector<HTMLElement>('.u-legend')!.offsetHeight, 0));
    if (height < kLow_px) {
      this.parent.classList.add('low');
      height = Math.max(part(0), kLowest_px);
    }
    this.plots.forEach((plot, i) => plot.setSize({width, height: height + (i === kCharts.length - 1 ? kFoot_px : 0)}));
  }

  private make(): void {
    for (const plot of this.plots) plot.destroy();
    const axis = {stroke: this.colours.axis, grid: {stroke: this.colours.grid, width: 1}, ticks: {stroke: this.colours.grid, width: 1}, font: '15px system-ui, sans-serif'};
    // Without a cursor the newest value is read.
    const value = (digits: number) => (plot: uPlot, v: number | null, series: number, at: number | null) => {
      const read = at === null ? plot.data[series]?.at(-1) : v;
      return read === null || read === undefined ? '–' : read.toFixed(digits);
    };
    this.plots = kCharts.map((series, chart) => new uPlot({
      width: 120,
      height: kLowest_px,
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
          spanGaps: false,
        })),
      ],
    }, [[], ...series.map(() => [])] as uPlot.AlignedData, this.parent));
    for (const plot of this.plots) this.resized.observe(plot.root.querySelector('.u-legend')!);
    this.size();
  }
}
