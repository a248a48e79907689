(** The theorems, and what they rest on; compared with assumptions.txt. *)
From Coq Require Import List Reals.
From Swarmcert Require Import Activations Form Network Sorting Checker Meaning Steepness Sets Enclosures Intervals
  Claims Silent Sound.
Open Scope R_scope.
Set Printing Width 120.
Check rising_slopes.
Print Assumptions rising_slopes.
Check all_slopes.
Print Assumptions all_slopes.
Check values_between_lies.
Print Assumptions values_between_lies.
Check sorting_contracts.
Print Assumptions sorting_contracts.
Check check_sound.
Print Assumptions check_sound.
Check check_parts_sound.
Print Assumptions check_parts_sound.
Check step_sound.
Print Assumptions step_sound.
Check accepted_hold.
Print Assumptions accepted_hold.
Check check_all_holds.
Print Assumptions check_all_holds.
Check silent_slope.
Print Assumptions silent_slope.
Check silent_slope_in_box.
Print Assumptions silent_slope_in_box.
Check silent_slope_among.
Print Assumptions silent_slope_among.
Check silent_law.
Print Assumptions silent_law.
