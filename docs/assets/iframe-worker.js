// Search in pages that are opened from disk: browsers start no workers there, so that an invisible
// frame runs the script of the search. The theme's own copy of this file would come from a server.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      this.inner = frame.contentWindow;
      this.inner.postMessage = (message) => window.postMessage({ search: message }, "*");
      this.inner.importScripts = (...addresses) =>
        addresses.reduce((before, address) => before.then(() => this.load(address)), Promise.resolve());
      window.addEventListener("message", (event) => {
        if (event.data?.search) {
          const answer = new MessageEvent("message", { data: event.data.search });
          this.dispatchEvent(answer);
          this.onmessage?.(answer);
        }
      });
      this.ready = this.load(url);
    }
    load(address) {
      return new Promise((resolve, reject) => {
        const script = this.inner.document.createElement("script");
        script.src = address;
        script.onload = resolve;
        script.onerror = reject;
        this.inner.document.body.append(script);
      });
    }
    postMessage(message) {
      this.ready.then(() => this.inner.dispatchEvent(new MessageEvent("message", { data: message })));
    }
    terminate() {
      this.inner.frameElement.remove();
    }
  };
}
