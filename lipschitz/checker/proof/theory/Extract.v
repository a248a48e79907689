(** The checker as OCaml: integers are those of GMP (zarith), natural numbers are machine integers. *)
From Coq Require Import ZArith List Extraction ExtrOcamlBasic ExtrOcamlNatInt.
From Swarmcert Require Import Algebra Activations Checker Meaning Steepness Claims.
Extract Inductive positive => "Big.t"
  ["(fun p -> Big.succ (Big.shift_left p 1))" "(fun p -> Big.shift_left p 1)" "Big.one"]
      "(fun _ _ _ _ -> assert false)".
Extract Inductive Z => "Big.t" ["Big.zero" "(fun p -> p)" "Big.neg"] "(fun _ _ _ _ -> assert false)".
Extract Inlined Constant Z.add => "Big.add".
Extract Inlined Constant Z.sub => "Big.sub".
Extract Inlined Constant Z.mul => "Big.mul".
Extract Inlined Constant Z.opp => "Big.neg".
Extract Inlined Constant Z.abs => "Big.abs".
Extract Inlined Constant Z.eqb => "Big.equal".
Extract Inlined Constant Z.leb => "Big.leq".
Extract Inlined Constant Z.ltb => "Big.lt".
(* Called with positive numbers. *)
Extract Inlined Constant Z.log2 => "(fun a -> Big.of_int (Big.log2 a))".
(* Called with distances that are not negative, and Z.div with a positive divisor. Big.to_int raises if a distance is
   huge, Big.shift_left and Big.shift_right if it is negative, Big.fdiv if the divisor is 0; all round down. *)
Extract Inlined Constant Z.div => "Big.fdiv".
Extract Inlined Constant Z.shiftl => "(fun a n -> Big.shift_left a (Big.to_int n))".
Extract Inlined Constant Z.shiftr => "(fun a n -> Big.shift_right a (Big.to_int n))".
Extraction "proved.ml" step.
