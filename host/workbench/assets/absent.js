// What a page without a server has not: a campaign made of a folder on the disk.
export const open = async () => {};
