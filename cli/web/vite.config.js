import {defineConfig} from 'vite';

export default defineConfig({
  base: './',
  build: {
    target: 'es2022',
    outDir: process.env.SCARP_PAGE_OUT ?? 'dist',
    emptyOutDir: true,
    assetsInlineLimit: 0,
    // MapLibre is about a megabyte, in one piece, whatever is done about it.
    chunkSizeWarningLimit: 1500,
    rollupOptions: {output: {manualChunks: {maplibre: ['maplibre-gl']}}},
  },
});
