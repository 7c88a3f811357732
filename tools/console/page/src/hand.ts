// The simulated operator's place: the pointer, the keys or a gamepad move the hand of a station that is simulated.
import type {Link} from './link';
import type {Telemetry} from './wire';

// Metres of the hand: for a pixel, a notch of the wheel; a second of a key or of a stick's full deflection.
const kPixel_m = 50e-6, kNotch_m = 1e-3, kKeys_m_s = 0.02, kStick_m_s = 0.1, kDeadZone = 0.15;
const kEvery_ms = 25, kAtLeastEvery_ms = 100;

type Button = 'hold' | 'inject' | 'clutch' | 'next';
const kPointer: [bit: number, button: Button][] = [[1, 'hold'], [2, 'inject'], [4, 'clutch']];  // of event.buttons
const kKeys: Record<string, Button> = {' ': 'hold', i: 'inject', k: 'clutch', enter: 'next'};
const kWays: Record<string, [axis: number, sign: number]> = {
  arrowleft: [0, -1], arrowright: [0, 1], arrowup: [1, 1], arrowdown: [1, -1], pageup: [2, 1], pagedown: [2, -1],
};
const kPad: Record<number, Button> = {5: 'hold', 0: 'inject', 4: 'clutch', 3: 'next'};

// What to do next, for somebody who does it for the first time.
// holds, injects: so long pressed that the station must know. opened: the injector was open since the membranes gave way.
export function nextStep(t: Telemetry, taken: boolean, holds: boolean, injects: boolean, opened: boolean): string {
  const kNotEnabled = 1 << 13, kRefused = 1 << 14;
  if (!taken) return 'Take the hand: click the button or press H. Then the mouse moves the needle, in the directions of the picture.';
  const kReleased = 17;
  if (t.stop !== 0) return t.fault === kReleased ? 'Stopped, since the button was let go or the page was silent: press it anew; if it is pressed, let it go first.' : 'The station stops.';
  if (t.alarms & kNotEnabled && holds) return 'Let the left button go and press it again.';
  if (t.alarms & kNotEnabled) return 'Hold the left button, or space: nothing moves without it, and letting go stops the station.';
  switch (t.phase) {
    case 0: case 1: return 'Move left to the cell, straight at its middle.';
    case 2: return 'Push on, until both membranes give way.';
    case 3: case 4:
      if (t.injector_open) return 'Keep inject pressed.';
      if (opened) return 'Draw back to the right.';
      if (t.alarms & kRefused) return 'Not yet: let inject go, push on a little, and press it again.';
      // A press asks for one dose, which late vision may have kept back.
      return injects ? 'Let inject go and press it again.' : 'Press inject: the right button, or I.';
    case 5: return 'Draw back to the right, out of the cell.';
    default: return 'Done: the run ends by itself.';
  }
}

export class Hand {
  taken = false;
  readonly moved_m: [number, number, number] = [0, 0, 0];
  private pressed = new Map<string, Button>();  // by what presses it
  private down = 0;  // buttons of the pointer, as last seen
  private padDown = new Set<string>();
  private ways = new Map<string, [number, number]>();
  private last = '';
  private toldAt = -Infinity;
  private before = performance.now();

  // place: where the pointer moves the hand. refused: with what the gateway says.
  constructor(private link: Link, private place: HTMLElement, private refused: (problem: string) => void) {
    const on = <K extends keyof HTMLElementEventMap>(kind: K, act: (event: HTMLElementEventMap[K]) => void) => place.addEventListener(kind, (event) => {
      if (!this.taken) return;
      event.preventDefault();
      event.stopPropagation();
      act(event);
    }, {capture: true, passive: false});
    // A second button comes and goes with a pointermove, and not always here: whatever is up anywhere is released.
    for (const kind of ['pointerdown', 'pointermove', 'pointerup'] as const) addEventListener(kind, (event) => {
      for (const [bit] of kPointer) if (!(event.buttons & bit)) this.release(`pointer ${bit}`);
      this.down = place.contains(event.target as Node) ? this.down & event.buttons : event.buttons;
    }, {capture: true});
    const pressNew = (event: PointerEvent) => {
      const rose = event.buttons & ~this.down;
      this.down = event.buttons;
      for (const [bit, button] of kPointer) if (rose & bit) this.press(`pointer ${bit}`, button);
    };
    on('pointerdown', pressNew);
    on('pointerup', () => {});
    on('mousedown', () => {});
    on('mouseup', () => {});
    on('pointermove', (event) => {
      pressNew(event);
      this.moved_m[0] += event.movementX * kPixel_m;
      this.moved_m[1] -= event.movementY * kPixel_m;
    });
    on('wheel', (event) => { this.moved_m[2] -= Math.sign(event.deltaY) * kNotch_m; });
    on('contextmenu', () => {});
    // Whoever looks elsewhere has let go.
    for (const kind of ['blur', 'pagehide'] as const) addEventListener(kind, () => this.letGo());
    addEventListener('pointercancel', () => this.letGo());
    document.addEventListener('visibilitychange', () => this.letGo());
    document.addEventListener('pointerlockchange', () => {
      if (document.pointerLockElement !== place) this.letGo();
    });
    setInterval(() => this.step(), kEvery_ms);
  }

  take(): void {
    this.taken = true;
    this.moved_m.fill(0);
    this.last = '';
    // Without it the pointer ends at the border of the screen; a browser may not allow it.
    try { void Promise.resolve(this.place.requestPointerLock()).catch(() => {}); } catch { /* not allowed */ }
  }
  giveBack(): void {
    if (!this.taken) return;
    this.letGo();
    this.taken = false;
    if (document.pointerLockElement === this.place) document.exitPointerLock();
  }

  // True: it was the hand's.
  key(event: KeyboardEvent): boolean {
    const key = event.key.toLowerCase(), down = event.type === 'keydown';
    if (!this.taken || !(key in kKeys || key in kWays)) return false;
    if (key in kWays) {
      if (!down) this.ways.delete(key);
      else if (!event.repeat) this.ways.set(key, kWays[key]!);
    } else if (!down) this.release(`key ${key}`);
    else if (!event.repeat) this.press(`key ${key}`, kKeys[key]);
    return true;
  }

  // For so long that the station must know.
  presses(button: Button): boolean { return [...this.pressed.values()].includes(button) && performance.now() - (this.pressedAt.get(button) ?? 0) > 500; }
  private pressedAt = new Map<Button, number>();
  private press(by: string, button?: Button): void {
    if (!button || this.pressed.has(by)) return;
    this.pressedAt.set(button, performance.now());
    this.pressed.set(by, button);
    this.step();
  }
  private release(by: string): void { if (this.pressed.delete(by)) this.step(); }
  private letGo(): void {
    this.pressed.clear();
    this.ways.clear();
    this.step();
  }

  private step(): void {
    const now = performance.now(), dt_s = Math.min(now - this.before, 100) / 1000;
    this.before = now;
    if (!this.taken) return;
    for (const [axis, sign] of this.ways.values()) this.moved_m[axis]! += sign * kKeys_m_s * dt_s;
    this.pad(dt_s);
    const held = new Set(this.pressed.values());
    const told = {moved_m: this.moved_m, hold: held.has('hold'), inject: held.has('inject'), clutch: held.has('clutch'), next: held.has('next')};
    const text = JSON.stringify(told);
    if (text === this.last ? now - this.toldAt < kAtLeastEvery_ms : now - this.toldAt < kEvery_ms - 1 && this.sameButtons(held)) return;
    this.last = text;
    this.toldAt = now;
    this.link.call('/punctum/hand', told, (problem) => { if (problem) this.refused(problem); });
  }
  // A button is told at once, a way when its time has come.
  private lastHeld = '';
  private sameButtons(held: Set<Button>): boolean {
    const key = [...held].sort().join(), same = key === this.lastHeld;
    this.lastHeld = key;
    return same;
  }

  private pad(dt_s: number): void {
    const pad = navigator.getGamepads?.().find((one) => one?.mapping === 'standard');
    for (const [index, button] of Object.entries(kPad)) {
      const is = pad?.buttons[Number(index)]?.pressed ?? false;
      if (!is) this.pressed.delete(`pad ${index}`);
      else if (!this.padDown.has(index)) this.pressed.set(`pad ${index}`, button);  // held through a letting go: to be pressed anew
      if (is) this.padDown.add(index);
      else this.padDown.delete(index);
    }
    [[0, 0, 1], [1, 1, -1], [2, 3, -1]].forEach(([axis, stick, sign]) => {
      const beyond = (Math.abs(pad?.axes[stick!] ?? 0) - kDeadZone) / (1 - kDeadZone);
      if (beyond > 0) this.moved_m[axis!]! += Math.sign(pad!.axes[stick!]!) * sign! * beyond ** 2 * kStick_m_s * dt_s;
    });
  }
}
