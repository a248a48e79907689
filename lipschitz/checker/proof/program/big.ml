(* The name under which extracted/proved.ml knows the integers of GMP. *)
include Z
