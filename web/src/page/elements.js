// Elements of the page; texts of files get in as text only.

/** An element with attributes and children, which are elements or texts. */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "class") {
      made.className = value;
    } else if (name.startsWith("on")) {
      made.addEventListener(name.slice(2), value);
    } else if (value !== false) {
      made.setAttribute(name, value === true ? "" : value);
    }
  }
  made.append(...children);
  return made;
}

/** A slider with its name and value: { row, value, reset }. */
export function slider(label, { min, max, step, value, show, onInput }) {
  const input = element("input", { type: "range", min, max, step, "aria-label": label });
  const output = element("output");
  const set = (next) => {
    input.value = next;
    output.textContent = show(Number(input.value));
    input.setAttribute("aria-valuetext", output.textContent);
  };
  set(value);
  input.addEventListener("input", () => {
    set(input.value);
    onInput(Number(input.value));
  });
  input.addEventListener("dblclick", () => {
    set(value);
    onInput(value);
  });
  const heading = element("span", { class: "label" }, element("span", {}, label), output);
  return { row: element("label", { class: "control" }, heading, input), input, set };
}

/** A choice: { row, input }. */
export function choice(label, options, value, onChange) {
  const input = element("select", { "aria-label": label });
  for (const [name, text] of Object.entries(options)) {
    input.append(element("option", { value: name, selected: name === value }, text));
  }
  input.addEventListener("change", () => onChange(input.value));
  const heading = element("span", { class: "label" }, label);
  return { row: element("label", { class: "control" }, heading, input), input };
}

export function checkbox(label, value, onChange) {
  const input = element("input", { type: "checkbox", checked: value });
  input.addEventListener("change", () => onChange(input.checked));
  return { row: element("label", { class: "check" }, input, label), input };
}

export function note(text) {
  return element("p", { class: "note" }, text);
}
