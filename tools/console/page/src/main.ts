// The operator's page: what the station does, what stopped it, and one button that stops it.
import './style.css';
import {Hand, nextStep} from './hand';
import {hasHeadset, type Headset} from './headset';
import {Link} from './link';
import {Parameters, type Parameter} from './parameters';
import {LivePicture, type PictureColours} from './picture';
import {Plots, type PlotColours} from './plots';
import {Replay} from './replay';
import {kNotTold, SceneView, type Colours} from './scene';
import {Scope, type ScopeColours} from './scope';
import {Target} from './target';
import {drawTiming, quantile_us, timingText, type Status} from './timing';
import {pitchOf, playCue, Sound} from './sound';
import {decode, word, type CellSurface, type Event, type Fixtures, type Observation, type Picture, type Telemetry, type Ticks} from './wire';

// Older than this is not shown as now.
const kStale_ms = 500;
// A stop that the core has not confirmed by then is told to be unconfirmed.
const kStopConfirmed_ms = 300;
const kMostEvents = 200, kWarning_ms = 1000;  // between two sounds of new alarms

interface State {
  core: string; run_end: string; t_s: number; tick: number; phase: string; cell: number; stop: string;
  fault?: {name: string; cause: string; next: string; cleared: string; t_s?: number};
  alarms: string[]; vision: boolean; missed_ticks: number; events_lost: number; samples_unusable: number; dropped?: number;
  role: string; control: string; in_control: string; refused: string; hand_here: boolean;
}

const kAlarms: Record<string, string> = {
  vision_stale: 'vision is too old: force fades, only withdrawal',
  force_limited: 'the force at the hand is at its limit',
  depth_limited: 'the depth limit holds the needle',
  travel_limited: 'a limit of travel or speed holds the needle',
  tip_force: 'the limit of the tip force holds the needle',
  model_invalid: 'the membrane model is outside its assumptions',
  phase_timeout: 'this phase takes longer than it should',
  overrun: 'too many missed ticks',
  sensor: 'a device gave no usable data',
  degraded: 'running without real-time rights',
  stiffness_reduced: 'the passivity guard renders less than was asked for',
  vision_implausible: 'vision claims what cannot be, and is not used',
  lateral_limited: 'sideways motion inside the cell is held',
  not_enabled: 'press the enabling device: no drive has power',
  injection_refused: 'the button is pressed, but the injector may not open here',
  forbidden_region: 'dish floor or holding pipette hold the needle',
};
const kCore: Record<string, string> = {
  waiting: 'the core has not begun',
  silent: 'the core does not tick',
  died: 'the control core has died',
  ended: 'the run has ended',
};

const by = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;
const say = (id: string, text: string) => {
  const element = by(id);
  if (element.textContent !== text) element.textContent = text;
};

// What the address keeps: view, follow, panel, theme, where the free view looks from, the scope's set-up; of a recording the moment, too.
const layout = new URLSearchParams(location.hash.slice(1));
function keep(key: string, value: string): void {
  layout.set(key, value);
  history.replaceState(null, '', '#' + layout.toString());
}

// The token that came with the address: kept by this tab alone, and no part of a link that is passed on.
const kToken = 'punctum.token';
if (layout.has('token')) {
  sessionStorage.setItem(kToken, layout.get('token')!);
  layout.delete('token');
  history.replaceState(null, '', '#' + layout.toString());
}

const root = document.documentElement;
const dark = layout.get('theme') ? layout.get('theme') === 'dark' : !matchMedia('(prefers-color-scheme: light)').matches;
root.classList.toggle('light', !dark);
const css = (name: string) => getComputedStyle(root).getPropertyValue(name).trim();
const sceneColours = (): Colours => ({
  background: css('--panel'), outer: css('--one'), inner: css('--two'), needle: '#c8d2d8', holder: '#8c98a0', guide: css('--faint'),
  force: css('--bad'), tip: css('--bad'), forbidden: css('--warning'),
});
const plotColours = (): PlotColours => ({line: [css('--one'), css('--two')], axis: css('--faint'), grid: css('--line')});

const scopeColours = (): ScopeColours => ({line: css('--one'), axis: css('--faint'), grid: css('--line'), mark: css('--two')});
const pictureColours = (): PictureColours => ({
  background: css('--panel'), text: css('--text'), outer: '#5cb8f0', inner: '#f0a040', needle: '#ff7f50', holder: '#aeb9c1', mark: '#f0c000',
});

const sound = new Sound();
const scope = new Scope(by('scope'), scopeColours());
const live = new LivePicture(by<HTMLCanvasElement>('live'), pictureColours());
const plots = new Plots(by('plots'), plotColours());
let view: SceneView | undefined;
try {
  view = new SceneView(by<HTMLCanvasElement>('scene'), by('view-labels'), sceneColours());
} catch (error) {
  by('view-note').hidden = false;
  say('view-note', 'This browser draws no 3-D scene (WebGL is missing); everything else works.');
  console.error(error);
}

let headset: Headset | undefined;
const kPanels = ['events', 'scope', 'timing', 'parameters'] as const;
type Panel = (typeof kPanels)[number];
let panel: Panel | undefined;
let newest: Telemetry | undefined, state: State | undefined;
let opened = false;  // the injector, since the membranes gave way
let tick = -1, tickAt = -Infinity;  // when the newest tick was told, however late it came
let stopAsked = -1, stopProblem = '';
let warnedAt = -Infinity, wasStale = true;
let unreadable = 0;
let coreStatus: Status | undefined;

// A recording that stands still is not old.
function isStale(): boolean { return !replay.paused && performance.now() - tickAt > kStale_ms; }

// ---- what comes ----
function onTelemetry(t: Telemetry, age_ms: number): void {
  const before = newest;
  newest = t;
  opened = t.injector_open || opened && (t.phase === 3 || t.phase === 4);
  if (t.tick !== tick) {
    tick = t.tick;
    tickAt = performance.now() - age_ms;
  }
  if (before && t.tick < before.tick) {  // another run, or a recording that was turned back: what was listed is still to come
    for (const line of [...by('events').children] as HTMLElement[]) if (Number(line.dataset['t']) > t.t_s) line.remove();
  }
  plots.add(t, replay.now?.speed ?? 1);
  view?.telemetry(t);
  if (!isStale()) sound.force(t.force_N ? Math.hypot(t.force_N.x, t.force_N.y, t.force_N.z) : 0);
  if (before && before.phase !== t.phase) {
    if (t.phase === 1) sound.cue('contact');
    else if (t.phase === 3) sound.cue('puncture');
  }
  if (t.fault !== 0 && before?.fault === 0) sound.cue('alarm');
  else if (before && t.alarms & ~before.alarms && performance.now() - warnedAt > kWarning_ms) {
    warnedAt = performance.now();
    sound.cue('warning');
  }
}

// As it was given.
function commandValue(e: Event): string {
  const is = e.command === undefined ? '' : word('CommandKind', e.command), value = Number(e.value.toPrecision(6));
  if (is === 'depth limit') return ` ${Number((1e6 * e.value).toPrecision(6))} µm`;
  if (is === 'hand force limit') return ` ${value} N`;
  if (is === 'effect gain') return ` of ${link.state.effects[e.target] ?? e.target} ${value}`;
  return is.endsWith('scale') ? ` ${value}` : '';
}

function eventText(e: Event): [text: string, kind: string] {
  const what = e.fault !== undefined ? word('Fault', e.fault) : e.alarm !== undefined ? word('Alarm', e.alarm)
    : e.phase !== undefined ? word('Phase', e.phase) : e.command !== undefined ? word('CommandKind', e.command)
    : e.end !== undefined ? word('RunEnd', e.end) : '';
  const kind = word('Event.Kind', e.kind);
  const who = kind.startsWith('command') ? (e.writer === 1 ? ' from the console' : ' from the parent') : '';
  return [`${kind}: ${what}${commandValue(e)}${who}`, kind === 'fault' ? 'bad' : kind === 'alarm on' || kind === 'command refused' ? 'warning' : ''];
}

function onEvent(e: Event): void {
  const line = document.createElement('li'), [text, kind] = eventText(e);
  line.textContent = `${e.t_s.toFixed(3).padStart(9, '\u2007')} s  ${text}`;
  if (kind) line.className = kind;
  line.dataset['t'] = String(e.t_s);
  const list = by('events');
  list.prepend(line);
  while (list.childElementCount > kMostEvents) list.lastElementChild!.remove();
}

const link = new Link(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/`, sessionStorage.getItem(kToken) ?? '', (topic, message, age_ms) => {
  try {
    if (topic === '/punctum/telemetry') onTelemetry(decode<Telemetry>('Telemetry', message), age_ms);
    else if (topic === '/punctum/observation') {
      const found = decode<Observation>('Observation', message);
      view?.observation(found);
      live.observation(found);
    } else if (topic === '/punctum/picture') live.take(decode<Picture>('Picture', message));
    else if (topic === '/punctum/ticks') {
      const ticks = decode<Ticks>('Ticks', message);
      scope.know(link.state.effects);
      scope.add(ticks.sample, ticks.lost);
    } else if (topic === '/punctum/replay') replay.told(JSON.parse(new TextDecoder().decode(message)));
    else if (topic === '/punctum/fixtures') view?.fixtures(JSON.parse(new TextDecoder().decode(message)) as Fixtures);
    else if (topic === '/punctum/surface') view?.surface(decode<CellSurface>('CellSurface', message));
    else if (topic === '/punctum/event') onEvent(decode<Event>('Event', message));
    else if (topic === '/punctum/status') {
      coreStatus = decode<Status>('Status', message);
      showTiming();
    } else if (topic === '/punctum/state') {
      state = JSON.parse(new TextDecoder().decode(message)) as State;
      show();
    } else if (topic === '/punctum/parameters') {
      parameters.told((JSON.parse(new TextDecoder().decode(message)) as {parameters: Parameter[]}).parameters);
    }
  } catch (error) {
    unreadable++;
    console.error(topic, error);
  }
}, () => {
  if (link.state.connected) {  // perhaps to another station, which tells all anew
    by('events').replaceChildren();
    replay.forget();
    parameters.forget();
    view?.fixtures(kNotTold);
  }
  show();
}, () => sessionStorage.removeItem(kToken));

const replay = new Replay(link, by('replay'), layout.has('t') ? Number(layout.get('t')) : undefined, (t_s) => keep('t', t_s.toFixed(3)));
const parameters = new Parameters(link, by('control'), by('control-note'), by('parameter-list'));

const target = new Target(parameters, live, by('target'), by('target-note'), by<HTMLButtonElement>('target-set'));
by('live').addEventListener('click', (event) => { if (!hand.taken) target.choose(event.offsetX, event.offsetY); });

const hand = new Hand(link, by('picture'), (problem) => say('hand-note', `${problem}.`));
let handWanted = false;  // control was asked for to have the hand
function takeHand(): void {
  if (hand.taken || handWanted) {
    handWanted = false;
    hand.giveBack();
    parameters.take(false);
  } else if (state?.hand_here) {
    handWanted = true;
    say('hand-note', '');
    parameters.take(true);
    showView(kLive);
  }
}
function showHand(): void {
  by('own-hand').hidden = !state?.hand_here;
  if (!state?.hand_here) return;
  const mine = state.control === 'yours' && link.state.connected && state.core === 'ticking';
  if (handWanted && mine && !hand.taken) hand.take();
  if (hand.taken && !mine) {
    hand.giveBack();
    handWanted = false;
    say('hand-note', state.core === 'ticking' ? 'The hand was lost.' : '');
  }
  by('picture').classList.toggle('taken', hand.taken);
  by('take-hand').setAttribute('aria-pressed', String(hand.taken));
  by('take-hand').firstChild!.textContent = hand.taken ? 'Give the hand back' : 'Take the hand';
  by<HTMLButtonElement>('take-hand').disabled = state.role !== 'operate' || state.control === "another's";
  say('hand-step', newest ? nextStep(newest, hand.taken, hand.presses('hold'), hand.presses('inject'), opened) : '');
  if (state.control === "another's") say('hand-note', `${state.in_control} has it.`);
}
by('take-hand').addEventListener('click', takeHand);

// ---- what is shown ----
function banner(): void {
  const box = by('banner');
  const set = (title: string, cause = '', next = '', clears = '', note = false) => {
    box.hidden = title === '';
    box.classList.toggle('note', note);
    say('banner-title', title);
    say('banner-cause', cause);
    say('banner-next', next);
    say('banner-clears', clears);
  };
  const fault = state?.fault;
  if (fault) {
    const at = fault.t_s === undefined ? '' : ` at ${fault.t_s.toFixed(3)} s`;
    const now = state!.stop === 'stopped' ? 'STOPPED' : state!.stop === 'stopping' ? 'STOPPING' : 'STOP LATCHED';
    set(`${now}: ${fault.name.replaceAll('_', ' ')}${at}`, `Cause: ${fault.cause}.`, `What to do: ${fault.next}.`, `It clears: ${fault.cleared}.`);
  } else if (stopAsked >= 0 && (stopProblem || performance.now() - stopAsked > kStopConfirmed_ms)) {
    set('⚠ THE STOP IS NOT CONFIRMED', stopProblem ? `${stopProblem}.` : 'The core has not said that it stops.', 'Press the emergency stop.');
  } else if (state?.core === 'died' || state?.core === 'silent') {
    set(`⚠ ${kCore[state.core]!.toUpperCase()}`, '', 'Press the emergency stop if anything moves.');
  } else if (state?.core === 'ended') {
    set(`The run has ended: ${state.run_end}`, '', '', '', true);
  } else if (!link.state.connected) {
    set('No connection', `${link.state.reason}.`, 'The page shows what it saw last, and connects again by itself. The emergency stop works without it.', '', true);
  } else if (isStale()) {
    set('No data', state ? kCore[state.core] ?? '' : '', 'What is shown is old.', '', true);
  } else {
    set('');
  }
}

function show(): void {
  const stale = isStale() || !link.state.connected || (state !== undefined && state.core !== 'ticking' && !replay.now);
  document.body.classList.toggle('stale', stale);
  if (stale) sound.silence();
  if (stale && !wasStale) sound.cue('stale');
  wasStale = stale;
  say('station', link.state.station || 'punctum');
  say('link', link.state.connected ? 'connected' : `not connected: ${link.state.reason}`);
  const age = (performance.now() - tickAt) / 1000, alarms = state?.alarms ?? [];
  const phase = newest ? word('Phase', newest.phase) : '–';
  say('phase', newest ? (newest.stop === 0 ? phase : `${word('StopStage', newest.stop)}, ${phase}`) : '–');
  say('time', newest ? `${newest.t_s.toFixed(1)} s, cell ${newest.cell + 1}${stale ? `, ${Number.isFinite(age) ? age.toFixed(1) : '?'} s old` : ''}` : '–');
  if (newest) {
    const f = newest.force_N;
    say('hand', (f ? Math.hypot(f.x, f.y, f.z) : 0).toFixed(2));
    say('needle', (newest.tip_force_N * 1e6).toFixed(2));
    say('depth', (newest.wd_m * 1e6).toFixed(1));
    const seen_s = newest.obs_age_s, none = state?.vision === false || seen_s < 0;
    say('vision', state?.vision === false ? 'none' : none ? 'starts' : seen_s < 1 ? (seen_s * 1e3).toFixed(0) : seen_s.toFixed(1));
    say('vision-unit', none ? '' : seen_s < 1 ? 'ms' : 's');
    view?.age(!none && (seen_s * 1e3 > kStale_ms || alarms.includes('vision_stale')) ? seen_s : undefined);
  }
  const box = by('alarms');
  const key = alarms.join();
  if (box.dataset['key'] !== key) {
    box.dataset['key'] = key;
    box.replaceChildren(...alarms.map((alarm) => {
      const chip = document.createElement('span');
      chip.textContent = kAlarms[alarm] ?? alarm;
      return chip;
    }));
  }
  const stopped = state?.fault !== undefined;
  by('stop').classList.toggle('asked', stopAsked >= 0 || stopped);
  by('stop').classList.toggle('unconfirmed', stopAsked >= 0 && !stopped && performance.now() - stopAsked > kStopConfirmed_ms);
  if (stopped) stopAsked = -1;
  by<HTMLButtonElement>('stop').disabled = replay.now !== undefined;
  say('stop-why', replay.now ? kRecording : '');
  banner();
  parameters.show(state, !stale);
  target.show(!by('live').hidden);
  showHand();
  say('counts', state ? [
    state.missed_ticks > 0 ? `${state.missed_ticks} ticks missed` : '',
    (state.dropped ?? 0) > 0 ? `${state.dropped} messages left out for this page` : '',
    state.events_lost > 0 ? `${state.events_lost} events lost` : '',
    state.samples_unusable + unreadable > 0 ? `${state.samples_unusable + unreadable} messages unusable` : '',
  ].filter(Boolean).join(', ') : '');
}

function showTiming(): void {
  if (panel !== 'timing') return;
  say('panel-title', coreStatus ? `Timing: ${timingText(coreStatus)}` : 'Timing');
  if (coreStatus) drawTiming(by<HTMLCanvasElement>('timing'), coreStatus, plotColours());
}

// ---- what is done ----
const kRecording = 'A recording: there is nothing to stop.';
function stop(): void {
  if (replay.now) return;
  stopAsked = performance.now();
  stopProblem = '';
  link.call('/punctum/stop', {}, (problem) => {
    stopProblem = problem;
    show();
  });
  show();
}
by('stop').addEventListener('click', stop);

const kLive = 5;
function showView(which: number): void {
  if (which !== kLive) view?.show(which);
  by('live').hidden = which !== kLive;
  by('scene').hidden = by('view-labels').hidden = which === kLive;
  link.want('/punctum/picture', which === kLive);
  for (const button of document.querySelectorAll<HTMLElement>('#views [data-view]')) {
    button.setAttribute('aria-pressed', String(button.dataset['view'] === String(which)));
  }
  keep('view', String(which));
}
for (const button of document.querySelectorAll<HTMLElement>('#views [data-view]')) {
  button.addEventListener('click', () => showView(Number(button.dataset['view'])));
}
function toggle(id: string, act: (on: boolean) => void): () => void {
  const button = by(id), flip = () => {
    const on = button.getAttribute('aria-pressed') !== 'true';
    button.setAttribute('aria-pressed', String(on));
    act(on);
  };
  button.addEventListener('click', flip);
  return flip;
}
const follow = toggle('follow', (on) => {
  view?.follow(on);
  keep('follow', on ? '1' : '0');
});
const freeze = toggle('freeze', (on) => plots.freeze(on));
// A scope that is armed listens, whatever is shown.
function wantTicks(): void {
  link.want('/punctum/ticks', panel === 'scope' || scope.armed);
  by('show-scope').firstChild!.textContent = scope.armed ? 'Scope (armed)' : scope.holds ? 'Scope (caught)' : 'Scope';
}
// One of them is shown; its key again shows the events.
function showPanel(which: Panel): void {
  panel = which === panel ? 'events' : which;
  for (const one of kPanels) {
    by(one).hidden = one !== panel;
    by(`show-${one}`).setAttribute('aria-pressed', String(one === panel));
  }
  document.body.dataset['panel'] = panel;
  wantTicks();
  say('panel-title', panel === 'events' ? 'Events' : panel === 'parameters' ? 'Parameters' : panel === 'scope' ? 'Scope: every tick' : '');
  keep('panel', panel);
  showTiming();
}
for (const one of kPanels) by(`show-${one}`).addEventListener('click', () => showPanel(one));
// What is read without the page: the first latched fault, or where the run is.
function words(): [string, boolean] {
  const fault = state?.fault, live = newest && !isStale() && link.state.connected;
  if (fault) return [`${state!.stop === 'stopped' ? 'STOPPED' : 'STOPPING'}: ${fault.name.replaceAll('_', ' ')}\n${fault.next}`, true];
  if (!live) return ['NO DATA\nwhat is shown is old', true];
  const f = newest!.force_N;
  return [`${word('Phase', newest!.phase)}\nhand ${(f ? Math.hypot(f.x, f.y, f.z) : 0).toFixed(2)} N, needle ${(newest!.tip_force_N * 1e6).toFixed(2)} µN, depth ${(newest!.wd_m * 1e6).toFixed(1)} µm\nsqueeze a hand: stop`, false];
}
headset = view?.headset(words, stop, () => by('headset').setAttribute('aria-pressed', String(headset?.isOn)));
const wear = () => {
  if (headset?.isOn) headset.end();
  else headset?.begin().catch((error) => say('counts', `The headset does not begin: ${error instanceof Error ? error.message : error}`));
};
by('headset').addEventListener('click', wear);
const lookForHeadset = () => void hasHeadset().then((there) => { by('headset').hidden = !there || headset === undefined; });
navigator.xr?.addEventListener('devicechange', lookForHeadset);
lookForHeadset();
const mute = toggle('sound', () => sound.toggle());
function theme(): void {
  const light = root.classList.toggle('light');
  keep('theme', light ? 'light' : 'dark');
  view?.paint(sceneColours());
  plots.paint(plotColours());
  scope.paint(scopeColours());
  live.paint(pictureColours());
}
by('theme').addEventListener('click', theme);

const moveCursor = (way: number) => (panel === 'scope' ? scope.moveCursor(way) : plots.moveCursor(10 * way));
const kTurn = 0.12;
const keys: Record<string, () => void> = {
  Escape: stop,
  0: () => showView(0), 1: () => showView(1), 2: () => showView(2), 3: () => showView(3), 4: () => showView(4), 5: () => showView(kLive),
  f: follow, m: mute, p: freeze, d: theme, e: () => showPanel('events'), j: () => showPanel('timing'), c: () => showPanel('parameters'),
  ArrowLeft: () => view?.turn(-kTurn, 0), ArrowRight: () => view?.turn(kTurn, 0),
  ArrowUp: () => view?.turn(0, -kTurn), ArrowDown: () => view?.turn(0, kTurn),
  '+': () => view?.zoom(0.9), '=': () => view?.zoom(0.9), '-': () => view?.zoom(1.1),
  ',': () => moveCursor(-1), '.': () => moveCursor(1), s: () => showPanel('scope'),
  v: wear, h: takeHand, ' ': () => replay.toggle(), n: () => replay.toMark(true), b: () => replay.toMark(false),
};
// Once the choice is made the keys are the page's again.
addEventListener('change', (event) => { if (event.target instanceof HTMLSelectElement) event.target.blur(); });
addEventListener('keyup', (event) => { if (hand.key(event)) event.preventDefault(); });
addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  if (hand.key(event)) {
    event.preventDefault();
    return;
  }
  const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  const focused = document.activeElement;
  // In the list of events the arrows scroll; a button, a box or a list in focus has keys of its own.
  if (!act || (event.key.startsWith('Arrow') && focused?.id === 'events')) return;
  if (event.key !== 'Escape' && (focused instanceof HTMLSelectElement || focused instanceof HTMLInputElement)) return;
  if (event.key === ' ' && focused instanceof HTMLButtonElement) return;
  event.preventDefault();
  act();
});

showView(Number(layout.get('view') ?? 1));
if (layout.get('follow') === '1') follow();
showPanel(kPanels.find((one) => one === layout.get('panel')) ?? 'events');
setInterval(show, 100);
setInterval(() => plots.draw(), 100);
setInterval(() => {
  wantTicks();
  if (panel === 'scope') scope.draw();
}, 100);
// Into the address once it is another than at first.
const kept = (): Record<string, string> => ({from: view?.viewpoint ?? '', channels: scope.channels, trigger: scope.setUp});
if (layout.has('from')) view?.lookFrom(layout.get('from')!);
scope.restore(layout.get('channels') ?? '', layout.get('trigger') ?? '');
const atFirst = kept();
setInterval(() => {
  for (const [key, value] of Object.entries(kept())) {
    atFirst[key] ||= value;
    if (value !== (layout.get(key) ?? atFirst[key])) keep(key, value);
  }
}, 300);
setInterval(() => live.draw(replay.paused), 50);
// Where drawing is slow, without a graphics processor, it takes a quarter of the time at most: clicks come first.
const kFrame_ms = 33;
let drawnAt = 0, nextAt = 0;
const frame = () => {
  const now = performance.now();
  if (drawnAt > 0 && view?.isDrawn) {
    nextAt = drawnAt + Math.max(kFrame_ms, 4 * (now - drawnAt));
    drawnAt = 0;
  }
  if (drawnAt === 0 && now >= nextAt && by('live').hidden && view?.render()) drawnAt = now;
  requestAnimationFrame(frame);
};
requestAnimationFrame(frame);

// For tests, and for whoever looks with the browser's console.
Object.assign(globalThis, {
  punctum: {
    get newest() { return newest; },
    get state() { return state; },
    get status() { return coreStatus; },
    get parameters() { return parameters.all; },
    get replay() { return replay.now; },
    scope, hand, headset, target, quantile_us,
    get drawn() { return {scene: view?.drawn, plots: plots.drawn, live: live.drawn}; },
    link: link.state,
    sound, playCue, pitchOf,
  },
});
