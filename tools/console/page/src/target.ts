// A click into the live picture chooses how deep the needle may go; a button then asks the station for it.
import type {Parameters} from './parameters';
import type {LivePicture} from './picture';

const kParameter = 'depth_limit', kDecimals = 1;

export class Target {
  chosen_um?: number;

  constructor(private parameters: Parameters, private live: LivePicture, private box: HTMLElement, private note: HTMLElement, private button: HTMLButtonElement) {
    button.addEventListener('click', () => this.ask());
  }

  // Pixels of the page, from the picture's corner.
  choose(x: number, y: number): void {
    this.chosen_um = undefined;
    const depth_um = Number((1e6 * this.live.depthAt(x, y)).toFixed(kDecimals)), problem = this.parameters.why || this.outOfReach(depth_um);
    if (!problem) this.chosen_um = depth_um;
    this.say(problem || `The needle goes no deeper than ${depth_um.toFixed(kDecimals)} µm past the membrane:`);
  }
  private outOfReach(depth_um: number): string {
    if (!Number.isFinite(depth_um)) return 'No depth is known here: vision sees no needle or no membrane in this picture, or it is old.';
    const out = this.parameters.objection(kParameter, depth_um);
    return out && `${depth_um.toFixed(kDecimals)} µm past the membrane. ${out}`;
  }

  private ask(): void {
    if (this.chosen_um === undefined) return;
    const asked_um = this.chosen_um;
    this.chosen_um = undefined;
    this.parameters.ask(kParameter, asked_um, (problem) => this.say(problem ? `${problem}.` : `Asked for ${asked_um.toFixed(kDecimals)} µm.`));
  }

  // Several times a second. seen: the picture is shown.
  show(seen: boolean): void {
    if (this.chosen_um !== undefined && (this.parameters.why || !seen)) {
      this.chosen_um = undefined;
      this.say(this.parameters.why);
    }
    const limit_um = this.parameters.all.find((p) => p.name === kParameter)?.value;
    this.live.depths(limit_um === undefined ? undefined : limit_um * 1e-6, this.chosen_um === undefined ? undefined : this.chosen_um * 1e-6);
    this.box.hidden = !seen || this.note.textContent === '';
    this.button.hidden = this.chosen_um === undefined;
  }
  private say(text: string): void { this.note.textContent = text; }
}
