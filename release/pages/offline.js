// From disk a browser starts no worker and reads no JSON. There this takes the place of search/worker.js.
if (location.protocol === "file:") {
  const load = (name) => new Promise((resolve) => {
    const script = document.createElement("script");
    script.src = `${base_url}/search/${name}`;
    script.onload = resolve;
    document.head.append(script);
  });
  let index;
  const documents = new Map();

  const build = async () => {
    await Promise.all([load("lunr.js"), load("search_index.js")]);
    const { config, docs } = window.searchIndex;
    lunr.tokenizer.separator = new RegExp(config.separator);
    index = lunr(function () {
      this.field("title");
      this.field("text");
      this.ref("location");
      for (const one of docs) {
        documents.set(one.location, { ...one, summary: one.text.slice(0, 200) });
        this.add(one);
      }
    });
    return config;
  };

  window.Worker = class {
    async postMessage(message) {
      if (message.init) {
        const config = await build();
        this.onmessage({ data: { config } });
        this.onmessage({ data: { allowSearch: true } });
      } else {
        const results = index.search(message.query).map(({ ref }) => documents.get(ref));
        this.onmessage({ data: { results } });
      }
    }
  };
}
