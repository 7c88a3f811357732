// The station as sound: force as pitch; contact, puncture, an alarm, a latched fault and data that stop coming, each distinct.

export const kLowest_Hz = 180, kHighest_Hz = 900, kFullForce_N = 3;
// Equal steps of force are equal intervals.
export function pitchOf(force_N: number): number {
  const part = Math.min(Math.max(force_N / kFullForce_N, 0), 1);
  return kLowest_Hz * (kHighest_Hz / kLowest_Hz) ** part;
}
const loudness = (force_N: number) => (force_N < 0.02 ? 0 : Math.min(0.02 + force_N * 0.05, 0.12));

export type Cue = 'contact' | 'puncture' | 'warning' | 'alarm' | 'stale';

function beep(context: BaseAudioContext, at_s: number, from_Hz: number, to_Hz: number, for_s: number, loud: number, type: OscillatorType): void {
  const tone = context.createOscillator(), gain = context.createGain();
  tone.type = type;
  tone.frequency.setValueAtTime(from_Hz, at_s);
  tone.frequency.exponentialRampToValueAtTime(to_Hz, at_s + for_s);
  gain.gain.setValueAtTime(0, at_s);
  gain.gain.linearRampToValueAtTime(loud, at_s + 0.005);
  gain.gain.exponentialRampToValueAtTime(1e-4, at_s + for_s);
  tone.connect(gain).connect(context.destination);
  tone.start(at_s);
  tone.stop(at_s + for_s);
}

export function playCue(context: BaseAudioContext, cue: Cue, at_s: number): void {
  if (cue === 'contact') {  // a tap
    beep(context, at_s, 1200, 1000, 0.06, 0.3, 'square');
  } else if (cue === 'puncture') {  // a falling pop
    beep(context, at_s, 700, 90, 0.4, 0.5, 'triangle');
  } else if (cue === 'warning') {  // a rising sweep
    beep(context, at_s, 330, 700, 0.3, 0.4, 'triangle');
  } else if (cue === 'stale') {  // two low, long tones
    for (const k of [0, 1]) beep(context, at_s + 0.45 * k, 220, 200, 0.4, 0.4, 'square');
  } else {  // two tones, twice
    for (const k of [0, 1, 2, 3]) beep(context, at_s + 0.18 * k, k % 2 === 0 ? 880 : 660, k % 2 === 0 ? 880 : 660, 0.16, 0.4, 'square');
  }
}

export class Sound {
  on = false;
  private context?: AudioContext;
  private tone?: OscillatorNode;
  private gain?: GainNode;

  // From a click or a key only: browsers start no sound by themselves.
  toggle(): boolean {
    this.on = !this.on;
    if (this.on && !this.context) {
      this.context = new AudioContext();
      this.tone = this.context.createOscillator();
      this.gain = this.context.createGain();
      this.gain.gain.value = 0;
      this.tone.connect(this.gain).connect(this.context.destination);
      this.tone.start();
    }
    if (this.on) void this.context?.resume();
    else void this.context?.suspend();
    return this.on;
  }

  force(force_N: number): void {
    if (!this.on || !this.context || !Number.isFinite(force_N)) return;
    const now = this.context.currentTime;
    this.tone?.frequency.setTargetAtTime(pitchOf(force_N), now, 0.02);
    this.gain?.gain.setTargetAtTime(loudness(force_N), now, 0.03);
  }

  silence(): void {
    if (this.context) this.gain?.gain.setTargetAtTime(0, this.context.currentTime, 0.02);
  }

  cue(cue: Cue): void {
    if (this.on && this.context) playCue(this.context, cue, this.context.currentTime);
  }
}
