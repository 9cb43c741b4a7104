// Where documents and updates come from: the JSON in the page, or the event stream of the server that sent it.

/** The text of a script element that holds JSON; null: the page has none of that name. */
export function embeddedText(page, name) {
  const element = page.getElementById(name);
  return element === null ? null : element.textContent;
}
