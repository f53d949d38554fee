// Formatting of numbers.

const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"]];

/** Return a value with three digits and a prefix: (0.00123, "J") is "1.23 mJ"; 1480 N/m has none, as in the terminal. */
export function formatQuantity(value, unit) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size < 1e-12) return `0 ${unit}`;
  if (unit.includes("/") && size >= 1) return `${Number(value.toPrecision(3))} ${unit}`.replace("-", "−");
  const [factor, prefix] = PREFIXES.find(([step]) => size >= step * 0.9995) ?? PREFIXES.at(-1);
  const scaled = value / factor;
  const digits = Math.abs(scaled) >= 99.95 ? 0 : Math.abs(scaled) >= 9.995 ? 1 : 2;
  return `${scaled.toFixed(digits).replace("-", "−")} ${prefix}${unit}`;
}

/** Return the limit of a stiffness, rounded down to three digits as in the terminal. */
export function formatLimit(stiffness) {
  if (!(stiffness > 0)) return formatQuantity(stiffness, "N/m");
  const step = 10 ** (Math.floor(Math.log10(stiffness)) - 2);
  return formatQuantity(step * Math.floor(stiffness / step * (1 + 1e-12)), "N/m");
}

/** Return a length in millimetres with constant width, so that a changing value does not jitter. */
export const formatMillimetres = value => (1e3 * value).toFixed(3).replace("-", "−").padStart(7, " ");

/** Return the least step of 1, 2 or 5 times a power of ten that divides a span into at most so many parts. */
export function roundStep(span, parts) {
  const rough = span / parts, power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map(factor => factor * power).find(step => step >= rough);
}
