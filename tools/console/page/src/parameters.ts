// What may be changed while the station runs, for whoever has control.
import type {Link} from './link';

export interface Parameter {
  name: string; unit: string; least: number; above_least: boolean; most: number; value: number; before: number; who: string; changed_s: number;
}
// Of the station's state: what concerns this client.
export interface Control { role: string; control: string; in_control: string; refused: string }

const kHeartbeat_ms = 500;
const number = (v: number) => String(Number(v.toPrecision(6)));
const isSame = (a: number, b: number) => number(a) === number(b);  // the station's value went through its own unit

// Why nothing can be changed now; empty: it can.
function whyNot(control: Control | undefined, fresh: boolean): string {
  if (!control || !fresh) return 'The station tells nothing now.';
  if (control.role !== 'operate') return 'Only whoever has a token to operate may change anything: open the address that punctum-console printed.';
  if (control.refused) return `Nothing but a stop is taken: ${control.refused}.`;
  if (control.control === "another's") return `${control.in_control} has control.`;
  return control.control === 'yours' ? '' : 'Take control first.';
}
function outOfRange(p: Parameter, value: number): string {
  const inside = (p.above_least ? value > p.least : value >= p.least) && value <= p.most;
  return inside ? '' : `Allowed: ${range(p)}.`;
}
const unit = (p: Parameter) => (p.unit === '1' ? '' : ` ${p.unit.replace('um', 'µm')}`);
const isFixed = (p: Parameter) => !(p.most > p.least);
const range = (p: Parameter) => isFixed(p) ? 'fixed in this scene' : `${p.above_least ? 'more than ' : ''}${number(p.least)} to ${number(p.most)}${unit(p)}`;

interface Row {
  p: Parameter; value: HTMLElement; input: HTMLInputElement; set: HTMLButtonElement; undo: HTMLButtonElement; who: HTMLElement; note: HTMLElement;
  earlier: number[]; expected: number[];  // values before this one, the newest last; what undoing asked for
  undoing: boolean;  // asked for, not answered: a second click would go back by one more
}

export class Parameters {
  all: Parameter[] = [];
  why = '';  // nothing can be changed now; empty: it can
  private rows: Row[] = [];
  private wanted = false;  // control
  private mine = false;
  private problem = '';    // with taking it
  private last = '';

  constructor(private link: Link, private button: HTMLButtonElement, private note: HTMLElement, private list: HTMLElement) {
    button.addEventListener('click', () => this.take(!this.mine));
    setInterval(() => {
      if (this.wanted) this.hold();
    }, kHeartbeat_ms);
  }

  told(all: Parameter[]): void {
    const same = all.length === this.all.length && all.every((p, i) => p.name === this.all[i]!.name);
    this.all = all;
    if (!same) this.make();
    this.rows.forEach((row, i) => {
      const p = all[i]!, undone = row.expected.findIndex((one) => isSame(one, p.value));
      if (undone >= 0) row.expected.splice(0, undone + 1);
      else if (!isSame(p.value, row.p.value)) row.earlier.push(row.p.value);
      row.p = p;
      row.value.textContent = `${number(p.value)}${unit(p)}`;
      row.who.textContent = `${isFixed(p) ? '' : 'allowed: '}${range(p)}; ${p.who === 'scene' ? 'as the scene has it' : `by ${p.who} at ${p.changed_s.toFixed(1)} s`}`;
    });
    this.last = '';
  }

  // The connection is another: perhaps to another station, whose values were not these before.
  forget(): void { this.all = []; }

  // Several times a second.
  show(control: Control | undefined, fresh: boolean): void {
    const why = this.why = whyNot(control, fresh), mine = control?.control === 'yours' && this.link.state.connected;
    if (this.mine && !mine && this.wanted) {  // whoever lost it asks again, with a click
      this.wanted = false;
      this.problem = 'Control was lost: this page was silent for too long, or the connection was cut';
    }
    this.mine = mine;
    const mayTake = fresh && control?.role === 'operate' && control.control !== "another's";
    const key = [why, mine, mayTake, this.problem, this.rows.map((row) => [row.earlier, row.undoing])].join(';');
    if (key === this.last) return;
    this.last = key;
    this.button.textContent = mine ? 'Give control back' : 'Take control';
    this.button.disabled = !mayTake;
    this.note.textContent = why || this.problem ? [this.problem && `${this.problem}.`, why].filter(Boolean).join(' ') : 'You have control.';
    for (const row of this.rows) {
      row.input.disabled = row.set.disabled = why !== '' || isFixed(row.p);
      row.undo.disabled = why !== '' || row.undoing || row.earlier.length === 0;
      row.undo.textContent = `Back to ${number(row.earlier.at(-1) ?? row.p.value)}`;
    }
  }

  take(wanted: boolean): void {
    this.wanted = wanted;
    this.problem = '';
    this.hold();
  }
  private hold(): void {
    const wanted = this.wanted;
    this.link.call('/punctum/control', {hold: wanted}, (problem) => {
      if (!problem || !wanted) return;
      this.wanted = false;
      this.problem = problem;
    });
  }

  private change(row: Row, value: number): void {
    row.note.textContent = Number.isFinite(value) ? outOfRange(row.p, value) : 'Not a number.';
    if (row.note.textContent) return;
    this.ask(row.p.name, value, (problem) => {
      row.note.textContent = problem ? `${problem}.` : '';
      if (!problem) row.input.value = '';
    });
  }
  // Step by step to what it was when this page came.
  private undo(row: Row): void {
    const value = row.earlier.pop();
    if (value === undefined) return;
    row.expected.push(value);
    row.undoing = row.undo.disabled = true;
    this.ask(row.p.name, value, (problem) => {
      row.undoing = false;
      row.note.textContent = problem ? `${problem}.` : '';
      if (!problem) return;
      row.expected = row.expected.filter((one) => one !== value);
      row.earlier.push(value);
    });
  }
  // What is wrong with this value, and what is allowed; empty: nothing.
  objection(name: string, value: number): string {
    const p = this.all.find((one) => one.name === name);
    return p ? isFixed(p) ? 'It is fixed in this scene.' : outOfRange(p, value) : 'This station has no such limit.';
  }
  ask(name: string, value: number, said: (problem: string) => void): void { this.link.call('/punctum/set', {name, value}, said); }

  private make(): void {
    const make = <K extends keyof HTMLElementTagNameMap>(tag: K, text = '') => {
      const element = document.createElement(tag);
      element.textContent = text;
      return element;
    };
    this.rows = this.all.map((p) => {
      const row: Row = {p, value: make('b'), input: make('input'), set: make('button', 'Set'), undo: make('button'), who: make('span'), note: make('em'),
        earlier: isSame(p.before, p.value) ? [] : [p.before], expected: [], undoing: false};
      const label = p.name.replaceAll('_', ' ');
      row.input.inputMode = 'decimal';
      row.input.setAttribute('aria-label', `new ${label}, ${range(p)}`);
      row.set.setAttribute('aria-label', `set ${label}`);
      row.input.addEventListener('keydown', (event) => {
        if (event.key === 'Escape') return;  // stops
        event.stopPropagation();
        if (event.key === 'Enter') this.change(row, this.typed(row));
      });
      row.set.addEventListener('click', () => this.change(row, this.typed(row)));
      row.undo.addEventListener('click', () => this.undo(row));
      return row;
    });
    this.list.replaceChildren(...this.rows.map((row) => {
      const line = make('li');
      line.append(make('span', row.p.name.replaceAll('_', ' ')), row.value, row.input, row.set, row.undo, row.who, row.note);
      return line;
    }));
  }
  private typed(row: Row): number { return row.input.value.trim() === '' ? NaN : Number(row.input.value.replace(',', '.')); }
}
