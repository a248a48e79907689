(** What the checker computes of values over boxes: intervals of the layers,
  and how far off a float32 evaluation may be. *)
From Coq Require Import List ZArith Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Lower.
Import ListNotations.

Definition at_most (x y : dyadic) : bool := is_nonnegative (add y (neg x)).
Fixpoint clampedD (c : list (dyadic * dyadic)) (x : list dyadic) : list dyadic :=
  match c, x with
  | (low, high) :: c', a :: x' =>
      let b := if at_most a low then low else a in (if at_most b high then b else high) :: clampedD c' x'
  | _, _ => x
  end.

Definition same (x y : dyadic) : bool := ((fst x =? fst y) && (snd x =? snd y))%Z.
Fixpoint same_numbers (x y : list dyadic) : bool :=
  match x, y with a :: x', b :: y' => same a b && same_numbers x' y' | [], [] => true | _, _ => false end.
Fixpoint same_box (x y : box) : bool :=
  match x, y with
  | a :: x', b :: y' => same (fst a) (fst b) && same (snd a) (snd b) && same_box x' y'
  | [], [] => true
  | _, _ => false
  end.
(** Each interval of b in that of a. *)
Fixpoint contains (a b : box) : bool :=
  match a, b with
  | (l, h) :: a', (l', h') :: b' => at_most l l' && at_most h' h && contains a' b'
  | [], [] => true
  | _, _ => false
  end.
Definition clamp_ends (c : list (dyadic * dyadic)) (b : box) : box :=
  combine (clampedD c (map fst b)) (clampedD c (map snd b)).
Definition relu_ends (i : dyadic * dyadic) : dyadic * dyadic := (reluD (fst i), reluD (snd i)).
Definition larger (x y : dyadic) : dyadic := if at_most x y then y else x.
Definition largest_abs (i : dyadic * dyadic) : dyadic := larger (abs (fst i)) (abs (snd i)).

(** Of a row times any vector in the box. *)
Fixpoint row_ends (row : list dyadic) (b : box) : dyadic * dyadic :=
  match row, b with
  | w :: row', (l, h) :: b' =>
      let (s, t) := row_ends row' b' in
      if is_nonnegative w then (add (mul w l) s, add (mul w h) t) else (add (mul w h) s, add (mul w l) t)
  | _, _ => (zero, zero)
  end.
(** Whether W x + c lies in v. *)
Fixpoint encloses (w : matrixD) (c : list dyadic) (b v : box) : bool :=
  match w, c, v with
  | row :: w', a :: c', (l, h) :: v' =>
      let (s, t) := row_ends row b in at_most l (add s a) && at_most (add t a) h && encloses w' c' b v'
  | [], [], [] => true
  | _, _, _ => false
  end.
(** `bounds`: of each hidden layer, before its ReLU. *)
Fixpoint check_layers (hidden : list layerD) (last : layerD) (b : box) (bounds : list box) (v : box) : bool :=
  match hidden, bounds with
  | [], [] => encloses (fst last) (snd last) b v
  | l :: hidden', c :: bounds' =>
      encloses (fst l) (snd l) b c && check_layers hidden' last (map relu_ends c) bounds' v
  | _, _ => false
  end.

(** How large the computed numbers may be: values in the box, errors r. *)
Fixpoint sizes (b : box) (r : list dyadic) : list dyadic :=
  match b, r with i :: b', a :: r' => add (largest_abs i) a :: sizes b' r' | _, _ => [] end.
Fixpoint size {A} (l : list A) : Z := match l with [] => 0%Z | _ :: l' => (1 + size l')%Z end.
(** n u + (n u)^2 >= (1 + u)^n - 1, u = 2^-24. *)
Definition gammaD (n : Z) : dyadic := let x := (n, (-24)%Z) in add x (mul x x).
(** `e` covers the rounding of a sum of n summands, the sum of whose sizes is m, and `before`. *)
Definition rounding_fits (n : Z) (m before e : dyadic) : bool :=
  (n <=? 8388608)%Z && at_most (add m (n, (-149)%Z)) (1, 126)%Z
  && at_most (add before (add (mul (gammaD n) m) (n, (-148)%Z))) e.
Fixpoint layer_fits (w : matrixD) (c : list dyadic) (m r e : list dyadic) : bool :=
  match w, c, e with
  | row :: w', a :: c', x :: e' =>
      let sizes_of_row := map abs row in
      rounding_fits (1 + size row)%Z (add (abs a) (dot zero add mul sizes_of_row m)) (dot zero add mul sizes_of_row
        r) x
      && layer_fits w' c' m r e'
  | [], [], [] => true
  | _, _, _ => false
  end.
Fixpoint check_roundings (hidden : list layerD) (last : layerD) (b : box) (r : list dyadic) (bounds : list box)
    (errors : list (list dyadic)) (e : list dyadic) : bool :=
  match hidden, bounds, errors with
  | [], [], [] => layer_fits (fst last) (snd last) (sizes b r) r e
  | l :: hidden', c :: bounds', s :: errors' =>
      encloses (fst l) (snd l) b c && layer_fits (fst l) (snd l) (sizes b r) r s
      && check_roundings hidden' last (map relu_ends c) s bounds' errors' e
  | _, _, _ => false
  end.

(** `low` to `high` vectors in v, and one in s. *)
Fixpoint add_ends (low high : Z) (v s : box) : box :=
  match v, s with
  | (l, h) :: v', (a, b) :: s' =>
      (add (mul ((if is_nonnegative l then low else high), 0%Z) l) a,
       add (mul ((if is_nonnegative h then high else low), 0%Z) h) b) :: add_ends low high v' s'
  | _, _ => []
  end.
Fixpoint sum_fits (count : Z) (m e errors : list dyadic) : bool :=
  match m, e, errors with
  | a :: m', b :: e', x :: errors' => rounding_fits count a b x && sum_fits count m' e' errors'
  | [], [], [] => true
  | _, _, _ => false
  end.
