// Where documents and updates come from: the JSON in the page, or the event stream of the server that sent it.

/** The text of a script element that holds JSON; null: the page has none of that name. */
export function embeddedText(page, name) {
  const element = page.getElementById(name);
  return element === null ? null : element.textContent;
}

/**
 * Call `take(update, connection)` for each update of an event stream, and `take(null, connection)` when the connection
 * has changed; `connection` is `live`, or says in words what it is instead.
 */
export function follow(address, take) {
  const stream = new EventSource(address);
  stream.onmessage = (event) => {
    const update = JSON.parse(event.data);
    take(update, "live");
    if (!update.ending) return;
    stream.close();
    take(null, `■ the run has ended: ${update.ending}`);
  };
  stream.onopen = () => take(null, "live");
  stream.onerror = () => take(null, "✗ the connection is lost; trying again");
}

/** The document of other rows of the run, as text. Throws an Error whose message is for the user. */
export async function fetchWindow(address, first, last) {
  const answer = await fetch(`${address}?first=${first}&last=${last}`);
  const text = await answer.text();
  if (!answer.ok) throw new Error(`The rows could not be had: ${text.trim()}`);
  return text;
}
