// Requests to the program, and nobody else. Whatever is refused comes back as an error with the page's words.

import { t } from "./words.js";

export class Refused extends Error {
  constructor(code, what) {
    super(t(`e-${code}`, { what }));
    this.code = code;
  }
}

let lost = () => {};
export const onLost = act => { lost = act; };

async function answer(response) {
  const text = await response.text();
  let value = {};
  try { value = JSON.parse(text); } catch { /* a page, not an answer */ }
  if (!response.ok) throw new Refused(value.error || "system", value.message || String(response.status));
  return value;
}

async function ask(path, options) {
  let response;
  try {
    response = await fetch(path, options);
  } catch {
    lost(true);
    throw new Refused("system", t("lost"));
  }
  lost(false);
  return answer(response);
}

export const get = path => ask(path);
export const post = (path, value) => ask(path, { method: "POST", headers: { "content-type": "application/json", "x-tsumu": "page" }, body: JSON.stringify(value) });
export const postText = (path, text) => ask(path, { method: "POST", headers: { "content-type": "application/json", "x-tsumu": "page" }, body: text });

// A path with each name made safe for an address.
export const path = place => place.split("/").map(encodeURIComponent).join("/");

// A file to the folder, straight from the disk; `told` hears the share that has gone. `cancel.now()` breaks it off.
export async function upload(file, told, cancel) {
  await get(`/api/may-upload/${encodeURIComponent(file.name)}/${file.size}`);
  return send(file, told, cancel);
}

function send(file, told, cancel) {
  return new Promise((done, failed) => {
    const request = new XMLHttpRequest();
    cancel.now = () => request.abort();
    request.open("POST", `/api/upload/${encodeURIComponent(file.name)}`);
    request.setRequestHeader("x-tsumu", "page");
    request.setRequestHeader("content-type", "application/octet-stream");
    request.upload.onprogress = e => told(e.total ? e.loaded / e.total : 0);
    request.onload = () => {
      let value = {};
      try { value = JSON.parse(request.responseText); } catch { /* no answer */ }
      request.status === 200 ? done(value.path) : failed(new Refused(value.error || "system", value.message || String(request.status)));
    };
    request.onerror = () => failed(new Refused("broken-off", file.name));
    request.onabort = () => failed(new Refused("broken-off", file.name));
    request.send(file);
  });
}

// Follows a piece of work to its end; `told` gets every new state. Ends early when `alive` says so.
export async function follow(id, told, alive = () => true) {
  let version = 0, misses = 0;
  while (alive()) {
    try {
      const now = await get(`/api/jobs/${id}/since/${version}`);
      misses = 0;
      if (now.version > version) told(now);
      version = now.version;
      if (!["waiting", "running"].includes(now.state)) return now;
      await pause(250);
    } catch (error) {
      if (error.code === "gone" || ++misses > 20) throw error;
      await pause(1500);
    }
  }
  return null;
}

export const pause = ms => new Promise(done => setTimeout(done, ms));
