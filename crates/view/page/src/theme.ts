// Dark or light: as the system has it, unless the user says otherwise.

import { byId } from "./dom";

type Theme = "light" | "dark";
const listeners: ((theme: Theme) => void)[] = [];
const system = matchMedia("(prefers-color-scheme: dark)");
let chosen: Theme | null = null;

export function theme(): Theme {
  return chosen ?? (system.matches ? "dark" : "light");
}

export function onTheme(listener: (theme: Theme) => void): void {
  listeners.push(listener);
  listener(theme());
}

/** A colour of the looks, by the name of its property. */
export function colourOf(property: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(property).trim();
}

export function setUpTheme(): void {
  const button = byId("theme") as HTMLButtonElement;
  const apply = () => {
    document.documentElement.dataset.theme = theme();
    const other = theme() === "dark" ? "light" : "dark";
    button.setAttribute("aria-label", `Use the ${other} theme`);
    button.title = `Use the ${other} theme`;
    listeners.forEach((listener) => listener(theme()));
  };
  button.addEventListener("click", () => {
    chosen = theme() === "dark" ? "light" : "dark";
    apply();
  });
  system.addEventListener("change", apply);
  apply();
}
