// How punctually the core wakes and how long its ticks take: both histograms since its start, both axes logarithmic.
export interface Histogram { bin: number[]; overflow: number; max_us: number }
export interface Status { ticks: number; missed: number; wake?: Histogram; tick?: Histogram }

const kMost_us = 10000, kGroups = 60;

// The value that this part of all entries does not exceed, in us; never better than the truth.
export function quantile_us(h: Histogram, part: number): number {
  const total = h.bin.reduce((a, b) => a + b, h.overflow);
  let seen = 0;
  for (let us = 0; us < h.bin.length; us++) {
    seen += h.bin[us]!;
    if (seen > 0 && seen >= part * total) return Math.min(us + 1, h.max_us);
  }
  return h.max_us;
}

// Entries in groups of equal width on the logarithmic axis from 1 us on; what is longer than the bins, where the longest was.
export function groups(h: Histogram): number[] {
  const counts = new Array<number>(kGroups).fill(0);
  const group = (us: number) => Math.min(Math.floor((Math.log(Math.max(us, 1)) / Math.log(kMost_us)) * kGroups), kGroups - 1);
  h.bin.forEach((n, us) => { counts[group(us + 0.5)]! += n; });
  if (h.overflow > 0) counts[group(h.max_us)]! += h.overflow;
  return counts;
}

export function drawTiming(canvas: HTMLCanvasElement, status: Status, colours: {line: string[]; axis: string; grid: string}): void {
  const ratio = devicePixelRatio, width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const draw = canvas.getContext('2d');
  if (!draw || width === 0) return;
  draw.scale(ratio, ratio);
  const foot = 20, left = 8, room = height - foot, wide = width - 2 * left;
  const x = (us: number) => left + (wide * Math.log(us)) / Math.log(kMost_us);
  draw.font = '14px system-ui, sans-serif';
  draw.fillStyle = colours.axis;
  draw.strokeStyle = colours.grid;
  draw.textAlign = 'center';
  for (const us of [1, 10, 100, 1000, 10000]) {
    draw.beginPath();
    draw.moveTo(x(us), 0);
    draw.lineTo(x(us), room);
    draw.stroke();
    draw.textAlign = us === 1 ? 'left' : us === kMost_us ? 'right' : 'center';
    draw.fillText(`${us} µs`, x(us), height - 5);
  }
  const all = [status.wake, status.tick].map((h) => (h ? groups(h) : []));
  const most = Math.log10(1 + Math.max(1, ...all.flat()));
  all.forEach((counts, which) => {
    draw.strokeStyle = colours.line[which]!;
    draw.lineWidth = 2;
    draw.setLineDash(which === 0 ? [] : [6, 4]);
    draw.beginPath();
    counts.forEach((n, g) => {
      const y = room - ((room - 4) * Math.log10(1 + n)) / most;
      draw.lineTo(left + (wide * g) / kGroups, y);
      draw.lineTo(left + (wide * (g + 1)) / kGroups, y);
    });
    draw.stroke();
  });
}

export function timingText(status: Status): string {
  const of = (name: string, h?: Histogram) => h
    ? `${name} p50 ${quantile_us(h, 0.5).toFixed(0)}, p99.9 ${quantile_us(h, 0.999).toFixed(0)}, max ${h.max_us.toFixed(0)} µs` : '';
  return [of('— wake-up', status.wake), of('- - tick', status.tick), `${status.missed} of ${status.ticks + status.missed} missed`].filter(Boolean).join('; ');
}
