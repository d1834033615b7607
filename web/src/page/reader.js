// The worker that reads lamps, and how long it may take.

const PATIENCE = 120_000; // Milliseconds for one file.

/** Reads files one at a time; a new one takes the place of one that is being read. */
export class Reader {
  constructor(source) {
    this.address = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
    this.waiting = new Map();
    this.count = 0;
    this.start();
  }

  start() {
    this.worker = new Worker(this.address);
    this.worker.onmessage = ({ data: { id, answer, refused } }) => {
      this.settle(id, (promise) => (refused ? promise.reject(new Error(refused))
        : promise.resolve(answer)));
    };
    this.worker.onerror = (event) => {
      event.preventDefault();
      this.stop("the reader of lamps has failed");
    };
  }

  settle(id, how) {
    const promise = this.waiting.get(id);
    this.waiting.delete(id);
    if (promise) {
      clearTimeout(promise.timer);
      how(promise);
    }
  }

  /** Ends what is being done, and begins anew. */
  stop(reason) {
    this.worker.terminate();
    for (const id of [...this.waiting.keys()]) {
      this.settle(id, (promise) => promise.reject(new Error(reason)));
    }
    this.start();
  }

  /** Asks the worker. */
  ask(request, transfer = []) {
    const id = this.count++;
    return new Promise((resolve, reject) => {
      const timer = setTimeout(() => this.stop("reading this file takes too long"), PATIENCE);
      this.waiting.set(id, { resolve, reject, timer });
      this.worker.postMessage({ ...request, id }, transfer);
    });
  }

  /** Reads a lamp; gives { issues, truncated, lamp }. */
  open(bytes, widest) {
    if (this.waiting.size) {
      this.stop("another file was opened");
    }
    return this.ask({ do: "open", bytes, widest }, [bytes]);
  }

  /** A network of the lamp that was read last. */
  network(name, widest) {
    return this.ask({ do: "network", name, widest });
  }
}
