// Exposure: the stops by which the picture in colour is brighter than the scene; each doubles the light.

export const gain = (stops) => 2 ** stops;

// The stops as the panel tells them, such as "+1.5".
export const told = (stops) => (stops > 0 ? "+" : "") + String(stops).replace("-", "\u2212");
