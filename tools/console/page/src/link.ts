// The connection to punctum-console: `foxglove.websocket.v1`. It comes back by itself.
import {Delay} from './delay';

// age_ms: how much longer it was under way than the quickest message.
export type Listener = (topic: string, message: DataView, age_ms: number) => void;
export interface LinkState { connected: boolean; reason: string; station: string; effects: string[] }

const kFirstPause_ms = 250, kLongestPause_ms = 4000;
export type Service = '/punctum/stop' | '/punctum/control' | '/punctum/set' | '/punctum/replay' | '/punctum/hand';
// Much at a time: told only while somebody looks.
export type OnDemand = '/punctum/ticks' | '/punctum/picture';
const kOnDemand: readonly string[] = ['/punctum/ticks', '/punctum/picture'];

export class Link {
  readonly state: LinkState = {connected: false, reason: 'connecting', station: '', effects: []};
  private socket?: WebSocket;
  private delay = new Delay();
  private topics = new Map<number, string>();  // by subscription
  private services = new Map<string, number>();
  private channels = new Map<string, number>();
  private wanted = new Set<string>();
  private calls = 0;
  private pause_ms = kFirstPause_ms;
  private answers = new Map<number, (problem: string) => void>();

  // token: says who this is; empty: whoever has none. refused: it is not shown again.
  constructor(private url: string, private token: string, private told: Listener, private changed: () => void, private refused: () => void) {
    this.connect();
  }

  private again(): void {
    setTimeout(() => void this.connectAgain(), this.pause_ms);
    this.pause_ms = Math.min(2 * this.pause_ms, kLongestPause_ms);
  }
  // A browser does not say why a WebSocket was not let in: whether a gateway is there is asked first, without the token.
  private async connectAgain(): Promise<void> {
    const there = this.token === '' || await fetch('/', {method: 'HEAD', cache: 'no-store'}).then((answer) => answer.ok, () => false);
    if (there) this.connect();
    else this.again();
  }

  private connect(): void {
    const shown = this.token !== '';
    const socket = new WebSocket(this.url, ['foxglove.websocket.v1', ...shown ? ['punctum.token.' + this.token] : []]);
    this.socket = socket;
    this.delay = new Delay();
    let opened = false;
    socket.onopen = () => { opened = true; };
    socket.binaryType = 'arraybuffer';
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
      try {
        if (typeof event.data === 'string') this.text(JSON.parse(event.data));
        else this.binary(new DataView(event.data));
      } catch (error) {
        socket.close(4000, 'a message that cannot be read');
        console.error(error);
      }
    };
    socket.onclose = (event) => {
      this.state.connected = false;
      if (shown && !opened) {  // it was of another gateway; this one may let whoever has none look
        this.token = '';
        this.refused();
      }
      this.state.reason = event.reason || 'no connection to punctum-console, or not let in without a token';
      this.services.clear();
      this.topics.clear();
      this.channels.clear();
      for (const answer of this.answers.values()) answer('the connection was lost');
      this.answers.clear();
      this.changed();
      this.again();
    };
  }

  private text(message: {op?: string} & Record<string, any>): void {
    if (message.op === 'serverInfo') {
      if (message.metadata?.wire !== '1') throw new Error('this page is of another version than punctum-console: load it again');
      this.delay.age_ms(Number(message.metadata.time_ns) / 1e6, performance.now());  // before anything can wait for the line
      this.state.connected = true;
      this.state.reason = '';
      this.state.station = message.metadata.station;
      this.state.effects = String(message.metadata.effects).split(',');
      this.pause_ms = kFirstPause_ms;
      this.changed();
    } else if (message.op === 'advertise') {
      this.channels = new Map(message.channels.map((channel: {id: number; topic: string}) => [channel.topic, channel.id]));
      this.subscribe([...this.channels.keys()].filter((topic) => !kOnDemand.includes(topic) || this.wanted.has(topic)));
    } else if (message.op === 'advertiseServices') {
      this.services = new Map(message.services.map((one: {id: number; name: string}) => [one.name, one.id]));
    } else if (message.op === 'serviceCallFailure') {
      this.answers.get(message.callId)?.(message.message);
      this.answers.delete(message.callId);
    }
  }

  private subscribe(topics: string[]): void {
    const ids = topics.map((topic) => this.channels.get(topic)).filter((id) => id !== undefined);
    for (const topic of topics) this.topics.set(this.channels.get(topic) ?? -1, topic);
    if (ids.length > 0) this.socket?.send(JSON.stringify({op: 'subscribe', subscriptions: ids.map((id) => ({id, channelId: id}))}));
  }
  want(topic: OnDemand, wanted: boolean): void {
    if (wanted === this.wanted.has(topic)) return;
    if (wanted) this.wanted.add(topic);
    else this.wanted.delete(topic);
    const id = this.channels.get(topic);
    if (id === undefined || this.socket?.readyState !== WebSocket.OPEN) return;
    if (wanted) this.subscribe([topic]);
    else this.socket.send(JSON.stringify({op: 'unsubscribe', subscriptionIds: [id]}));
  }

  private binary(message: DataView): void {
    const kind = message.getUint8(0);
    if (kind === 1) {
      const topic = this.topics.get(message.getUint32(1, true));
      const age_ms = this.delay.age_ms(Number(message.getBigUint64(5, true)) / 1e6, performance.now());
      if (topic) this.told(topic, new DataView(message.buffer, message.byteOffset + 13, message.byteLength - 13), age_ms);
    } else if (kind === 3) {
      const call = message.getUint32(5, true);
      this.answers.get(call)?.('');
      this.answers.delete(call);
    }
  }

  // answered: with what is wrong, or nothing when it was taken; a command then stands in the core's queue.
  call(service: Service, asked: object, answered: (problem: string) => void): void {
    const id = this.services.get(service);
    if (id === undefined || this.socket?.readyState !== WebSocket.OPEN) {
      answered('there is no connection to the station');
      return;
    }
    const call = ++this.calls, encoding = new TextEncoder().encode('json'), request = new TextEncoder().encode(JSON.stringify(asked));
    const message = new DataView(new ArrayBuffer(13 + encoding.length + request.length));
    message.setUint8(0, 2);
    message.setUint32(1, id, true);
    message.setUint32(5, call, true);
    message.setUint32(9, encoding.length, true);
    const bytes = new Uint8Array(message.buffer);
    bytes.set(encoding, 13);
    bytes.set(request, 13 + encoding.length);
    this.answers.set(call, answered);
    this.socket.send(message.buffer as ArrayBuffer);
  }
}
