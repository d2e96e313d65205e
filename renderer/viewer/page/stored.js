// What the browser keeps for this page, as JSON: "localStorage" for good, "sessionStorage" as long as the tab.

// What is kept under a key; null where there is nothing. Some frames and private windows keep nothing.
export function read(storage, key) {
  try {
    return JSON.parse(window[storage].getItem(key));
  } catch {
    return null;
  }
}

// Keep a value; returns whether the browser does.
export function write(storage, key, value) {
  try {
    window[storage].setItem(key, JSON.stringify(value));
    return true;
  } catch {
    return false;
  }
}
