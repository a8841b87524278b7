// One question at a time, and always the newest: while one is under way, what is asked replaces
// what waits. So a slow server is never behind by more than one answer.

export class Newest {
  #waiting = null;
  #under_way = null;

  /** @param {(signal: AbortSignal) => Promise<void>} question */
  ask(question) {
    this.#waiting = question;
    if (!this.#under_way) void this.#run();
  }

  /** Forgets what waits and leaves what is under way. */
  stop() {
    this.#waiting = null;
    this.#under_way?.abort();
  }

  async #run() {
    while (this.#waiting) {
      const question = this.#waiting;
      this.#waiting = null;
      this.#under_way = new AbortController();
      try {
        await question(this.#under_way.signal);
      } finally {
        this.#under_way = null;
      }
    }
  }
}
