"""Effect-free data of the same arm, and the thresholds that follow from them."""
