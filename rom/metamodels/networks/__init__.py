"""Networks: neural regressions of reduced coordinates; torch is imported when one is fitted, loaded or asked."""
