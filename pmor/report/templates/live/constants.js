// Constants of the kernels, as the page's data has them.
const {
  MAX_STEPS, PATIENCE, TOLERANCE, NEARBY, ROUND_OFF, BEGINNING, SHORT, LONGEST, NEAREST, CORNER, LEAST_ROLL, LEAST_LEVER,
  WIDEST, PRESSURES,
} = DATA.constants;
