// Where documents and updates come from: the JSON in the page, or the server that sent it.

/** The text of a script element that holds JSON; null: the page has none of that name. */
export function embeddedText(page, name) {
  const element = page.getElementById(name);
  return element === null ? null : element.textContent;
}

/** How old the newest row of an update is when it has come, in milliseconds: the name of its event ends with the time
 * at which it was sent. */
export function behindOf(update, name, now) {
  const sent = Number(name.split(".").pop());
  return update.behind_ms + (sent > 0 ? Math.max(0, now - sent) : 0);
}

/** What is said of a connection instead of `live`, by the state of its stream. */
export function wordLost(state) {
  return state === 2 ? "✗ the connection is lost: load the page again" : "✗ the connection is lost; trying again";
}

/**
 * Call `take(update, connection)` for each update of an event stream, and `take(null, connection)` when the connection
 * has changed; `connection` is `live`, or says in words what it is instead. Where another run goes on, the page is
 * loaded again, by `again`.
 */
export function follow(address, take, outside = {}) {
  const { again = () => globalThis.location.reload(), now = Date.now } = outside;
  const stream = outside.open ? outside.open(address) : new EventSource(address);
  let connection = "live";
  stream.onmessage = (event) => {
    const update = JSON.parse(event.data);
    update.behind_ms = behindOf(update, event.lastEventId, now());
    connection = update.ending ? `■ the run is over: ${update.ending}` : "live";
    take(update, connection);
  };
  stream.onopen = () => take(null, connection);
  stream.onerror = () => take(null, wordLost(stream.readyState));
  stream.addEventListener("document", () => {
    stream.close();
    again();
  });
}

/** The document of other rows of the run, as text. Throws an Error whose message is for the user. */
export async function fetchWindow(address, first, last) {
  const answer = await fetch(`${address}?first=${first}&last=${last}`);
  const text = await answer.text();
  if (!answer.ok) throw new Error(`The rows could not be had: ${text.trim()}`);
  return text;
}
