/** report/assets/uplot, as it is shipped: without types. */
declare const uPlot: any;
