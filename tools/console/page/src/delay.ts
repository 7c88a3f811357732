// How old a message is when it arrives, by the time that the gateway put into it. The two clocks are not compared: the
// quickest message of this connection counts as new, and how much longer another took is its age.

// Clocks run apart by up to 100 ppm each, which is followed. A line that stays late is found out for hours.
const kDrift = 2e-4;

export class Delay {
  private least_ms = Infinity;
  private at_ms = 0;

  // sent_ms by the gateway's clock, now_ms by the page's, which never goes back.
  age_ms(sent_ms: number, now_ms: number): number {
    const apart_ms = now_ms - sent_ms;
    this.least_ms = Math.min(apart_ms, this.least_ms + kDrift * (now_ms - this.at_ms));
    this.at_ms = now_ms;
    return apart_ms - this.least_ms;
  }
}
