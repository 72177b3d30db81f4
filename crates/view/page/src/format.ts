// Numbers and units for people.

const MINUS = "\u2212";

/** Fixed decimals with a true minus sign. */
export function fixed(x: number, decimals: number): string {
  const text = x.toFixed(decimals);
  return /[1-9]/.test(text) ? text.replace("-", MINUS) : text.replace("-", "");
}

/** About so many significant digits, with a power of ten where it is very large or small. */
export function compact(x: number, digits = 3): string {
  if (!Number.isFinite(x)) return "\u2013";
  if (x === 0) return "0";
  const power = Math.floor(Math.log10(Math.abs(x)));
  if (power >= -3 && power < 5) return fixed(x, Math.max(0, Math.min(6, digits - 1 - power)));
  return `${fixed(x / 10 ** power, digits - 1)}\u202f\u00d7\u202f10${raised(power)}`;
}

export function raised(power: number): string {
  const digits = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079";
  return String(power).replace("-", "\u207b").replace(/\d/g, (digit) => digits[Number(digit)]!);
}

/** From a shown unit to SI, without the noise of a factor such as 0.001. */
export function toSi(shown: number, factor: number): number {
  const inverse = Math.round(1 / factor);
  return factor < 1 && Math.abs(inverse * factor - 1) < 1e-12 ? shown / inverse : shown * factor;
}

/** Whole numbers with thin spaces, such as 226 981. */
export function whole(x: number): string {
  return Math.round(x).toString().replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f");
}

/** Decimals with which steps of a range are told apart. */
export function decimalsFor(range: number, steps = 1000): number {
  return Math.max(0, Math.min(9, Math.ceil(-Math.log10(Math.abs(range) / steps || 1))));
}

/** The number that a person typed, with a comma or a true minus; NaN for none. */
export function parse(text: string): number {
  const plain = text.trim().replace(/\u2212/g, "-").replace(/\s/g, "").replace(",", ".");
  return plain === "" ? NaN : Number(plain);
}

/** The smallest of 1, 2, 5 times a power of ten that is not below x. */
export function roundUp(x: number): number {
  const power = 10 ** Math.floor(Math.log10(x));
  return power * ([1, 2, 5, 10].find((step) => x <= step * power * (1 + 1e-9)) ?? 10);
}

/** Round values between two limits, at least `spacing` apart. */
export function ticks(low: number, high: number, spacing: number): { value: number; label: string }[] {
  const step = roundUp(spacing);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k <= high / step + 1e-9; k++) {
    found.push({ value: k * step, label: fixed(k * step, decimals) });
  }
  return found;
}

/** A column's values in a unit that reads well. */
export function shownUnit(unit: string, largest: number): { unit: string; factor: number } {
  if (unit === "m" && largest < 2) return largest < 2e-3 ? { unit: "\u00b5m", factor: 1e-6 } : { unit: "mm", factor: 1e-3 };
  if (unit === "rad") return { unit: "\u00b0", factor: Math.PI / 180 };
  return { unit, factor: 1 };
}

/** Short enough for a field: three digits, with an exponent where it is very large or small. */
export function brief(x: number): string {
  const power = x === 0 ? 0 : Math.floor(Math.log10(Math.abs(x)));
  return power >= -3 && power < 5 ? compact(x) : x.toExponential(1).replace("-", MINUS);
}

/** About nine digits, for a table; every digit stands in its title. */
export function digits(x: number): string {
  const text = String(x);
  const short = x.toPrecision(9).replace(/\.?0+($|e)/, "$1");
  return (short.length < text.length ? short : text).replace(/-/g, MINUS);
}
