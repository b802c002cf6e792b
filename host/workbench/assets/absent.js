// What a page without a server has not: a device that is followed, a campaign made of a folder on the disk.
export const build = () => {}, toggle = () => {}, onVerdict = () => {}, heard = () => {};
export const open = async () => {};
export const verdict = () => null;
export const key = () => false;
