(** What the checker computes of values over boxes: intervals of the layers,
  and how far off a float32 evaluation may be. *)
From Coq Require Import List ZArith Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Fixed Meaning Lower.
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
(** How far off a sum of n summands is, in whatever order, the sum of whose sizes is m. *)
Definition any_rounding (n : Z) (m : dyadic) : option dyadic :=
  if (n <=? 8388608)%Z && at_most (add m (n, (-149)%Z)) (1, 126)%Z
  then Some (add (mul (gammaD n) m) (n, (-148)%Z)) else None.
Definition rounding_fits (n : Z) (m before e : dyadic) : bool :=
  match any_rounding n m with Some d => at_most (add before d) e | None => false end.
(** How far off an operation is whose result is at most m. *)
Definition one_rounding (m : dyadic) : dyadic :=
  if is_positive m then add (1, snd m + Z.log2 (fst m) - 24)%Z (1, -150)%Z else (1, -150)%Z.
(** How far off the sum is if the products of the row with numbers in h are added in order to one that is off by at most
    `off` from one in s. *)
Fixpoint ordered_rounding (row : list dyadic) (h : box) (s : dyadic * dyadic) (off : dyadic) : option dyadic :=
  match row, h with
  | w :: row', i :: h' =>
      let p := if is_nonnegative w then (mul w (fst i), mul w (snd i)) else (mul w (snd i), mul w (fst i)) in
      let t := (add (fst s) (fst p), add (snd s) (snd p)) in
      let d := add off (one_rounding (largest_abs p)) in
      let m := add (largest_abs t) d in
      if at_most (add (largest_abs p) m) (1, 126)%Z
      then ordered_rounding row' h' t (ceil_to (-160) (add d (one_rounding m))) else None
  | _, _ => Some off
  end.
(** Each number of one in b off by at most that of r. *)
Fixpoint widened (b : box) (r : list dyadic) : box :=
  match b, r with (l, h) :: b', a :: r' => (add l (neg a), add h a) :: widened b' r' | _, _ => [] end.
(** How far off a layer is by itself, for inputs in h of the sizes m. *)
Fixpoint layer_roundings (in_order : bool) (w : matrixD) (c : list dyadic) (h : box) (m : list dyadic)
    : option (list dyadic) :=
  match w, c with
  | row :: w', a :: c' =>
      let d := if in_order then ordered_rounding row h (a, a) zero
               else any_rounding (1 + size row)%Z (add (abs a) (dot zero add mul (map abs row) m)) in
      match d, layer_roundings in_order w' c' h m with Some x, Some ds => Some (x :: ds) | _, _ => None end
  | [], [] => Some []
  | _, _ => None
  end.
(** `e` covers these and what r, the errors of the inputs, comes to behind the layer. *)
Fixpoint errors_fit (w : matrixD) (r ds e : list dyadic) : bool :=
  match w, ds, e with
  | row :: w', d :: ds', x :: e' =>
      at_most (add (dot zero add mul (map abs row) r) d) x && errors_fit w' r ds' e'
  | [], [], [] => true
  | _, _, _ => false
  end.
(** A vector that is off by `off` before a layer of norm n, and by `ds` more behind it, is then off by `x`. *)
Definition norm_fits (n off x : dyadic) (ds : list dyadic) : bool :=
  let d := add x (neg (mul n off)) in is_nonnegative d && at_most (squareD ds) (mul d d).
(** Number by number, and by the norm of what the layers add; `norms` and `offs` as long as there are layers. *)
Fixpoint check_roundings (in_order : bool) (hidden : list layerD) (last : layerD) (b : box) (r : list dyadic)
    (bounds : list box) (errors : list (list dyadic)) (e norms : list dyadic) (off : dyadic) (offs : list dyadic)
    (u : dyadic) : bool :=
  let fits (l : layerD) (n x : dyadic) (s : list dyadic) :=
    match layer_roundings in_order (fst l) (snd l) (widened b r) (sizes b r) with
    | Some ds => errors_fit (fst l) r ds s && norm_fits n off x ds
    | None => false
    end in
  match hidden, bounds, errors, norms, offs with
  | [], [], [], [n], [] => fits last n u e
  | l :: hidden', c :: bounds', s :: errors', n :: norms', x :: offs' =>
      encloses (fst l) (snd l) b c && fits l n x s
      && check_roundings in_order hidden' last (map relu_ends c) s bounds' errors' e norms' x offs' u
  | _, _, _, _, _ => false
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
