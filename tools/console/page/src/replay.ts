// A recording that is played: where it is, its marks, and how it goes on.
import type {Link} from './link';

interface Mark { t_s: number; text: string }
interface Told { first_s: number; last_s: number; now_s: number; speed: number; playing: boolean; marks?: Mark[] }

const kSpeeds = [0.01, 0.1, 0.25, 0.5, 1, 2, 5, 10, 100], kSteps = 10000;

export class Replay {
  now?: Told;
  private marks: Mark[] = [];
  private slider: HTMLInputElement; private play: HTMLButtonElement; private speed: HTMLSelectElement;
  private time: HTMLElement; private ticks: HTMLElement; private note: HTMLElement;
  private dragged = false;

  // wanted_s: of the address; sought: the moment is in the address from then on.
  constructor(private link: Link, private parent: HTMLElement, private wanted_s: number | undefined, private sought: (t_s: number) => void) {
    const button = (text: string, label: string, key: string, act: () => void) => {
      const made = document.createElement('button'), shown = document.createElement('kbd');
      made.textContent = text;
      made.setAttribute('aria-label', label);
      shown.textContent = key;
      made.append(shown);
      made.addEventListener('click', act);
      return made;
    };
    this.play = button('Pause', 'pause or play', 'Space', () => this.toggle());
    this.slider = document.createElement('input');
    this.slider.type = 'range';
    this.slider.min = '0';
    this.slider.max = String(kSteps);
    this.slider.setAttribute('aria-label', 'moment of the run');
    this.slider.addEventListener('input', () => { this.dragged = true; });
    this.slider.addEventListener('change', () => {
      this.dragged = false;
      if (this.now) this.seek(this.now.first_s + (Number(this.slider.value) / kSteps) * (this.now.last_s - this.now.first_s));
    });
    this.ticks = document.createElement('div');
    this.ticks.className = 'marks';
    this.time = document.createElement('span');
    this.note = document.createElement('em');
    this.note.setAttribute('role', 'status');
    this.speed = document.createElement('select');
    this.speed.setAttribute('aria-label', 'speed');
    this.speed.append(...kSpeeds.map((s) => new Option(`× ${s}`, String(s))));
    this.speed.addEventListener('change', () => this.ask({speed: Number(this.speed.value)}));
    const bar = document.createElement('div');
    bar.className = 'bar';
    bar.append(this.slider, this.ticks);
    parent.append(this.play, button('Back', 'to the mark before', 'B', () => this.toMark(false)), bar, button('Next', 'to the next mark', 'N', () => this.toMark(true)),
      this.speed, this.time, this.note);
  }

  // The connection is another: perhaps to a station.
  forget(): void {
    this.now = undefined;
    this.parent.hidden = true;
  }
  get paused(): boolean { return this.now !== undefined && !this.now.playing; }

  told(told: Told): void {
    this.now = told;
    this.parent.hidden = false;
    if (told.marks) {
      this.marks = told.marks;
      const length = Math.max(told.last_s - told.first_s, 1e-9);
      this.ticks.replaceChildren(...told.marks.map((mark) => {
        const tick = document.createElement('i');
        tick.style.left = `${((mark.t_s - told.first_s) / length) * 100}%`;
        tick.title = `${mark.t_s.toFixed(3)} s  ${mark.text}`;
        if (mark.text.startsWith('fault')) tick.className = 'bad';
        return tick;
      }));
    }
    if (this.wanted_s !== undefined && this.link.state.connected) {
      const t_s = this.wanted_s;
      this.wanted_s = undefined;
      this.ask({playing: false});
      this.seek(t_s);
    }
    if (!this.dragged) this.slider.value = String(Math.round(((told.now_s - told.first_s) / Math.max(told.last_s - told.first_s, 1e-9)) * kSteps));
    this.play.firstChild!.textContent = told.playing ? 'Pause' : 'Play';
    if (![...this.speed.options].some((o) => Number(o.value) === told.speed)) this.speed.append(new Option(`× ${told.speed}`, String(told.speed)));
    if (document.activeElement !== this.speed) this.speed.value = String(told.speed);
    const mark = [...this.marks].reverse().find((m) => m.t_s <= told.now_s + 5e-4);
    this.time.textContent = `${told.now_s.toFixed(3)} of ${told.last_s.toFixed(3)} s${mark ? `, after: ${mark.text}` : ''}`;
  }

  toggle(): void {
    if (!this.now) return;
    this.ask({playing: !this.now.playing});
    this.sought(this.now.now_s);
  }
  seek(t_s: number): void {
    this.ask({seek: t_s});
    this.sought(t_s);
  }
  // Of those at the same tick one is enough.
  toMark(next: boolean): void {
    if (!this.now) return;
    const now = this.now.now_s;
    const mark = next ? this.marks.find((m) => m.t_s > now + 1e-6) : [...this.marks].reverse().find((m) => m.t_s < now - 1e-3);
    if (mark) this.seek(mark.t_s);
  }
  private ask(wish: object): void {
    this.link.call('/punctum/replay', wish, (problem) => { this.note.textContent = problem ? `${problem}.` : ''; });
  }
}
