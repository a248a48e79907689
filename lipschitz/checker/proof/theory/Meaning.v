(** What the claims of a certificate mean, over the real numbers. Together with `act` of Activations.v and what it
  names, `network` and `affine` of Network.v, `norm` and `minus` of Form.v and Network.v, `real` of Checker.v (mantissa
  times 2^exponent) and, for what is said of float32, the first definitions of Float.v, this is all that has to be read
  to know what an accepted certificate states. *)
From Coq Require Import List ZArith Reals.
From Swarmcert Require Import Algebra Activations Form Network Checker Float.
Import ListNotations.

(** Weights by rows, biases. *)
Definition layerD := (matrixD * list dyadic)%type.
(** One network as stored; with an input clamp, an interval per input, else []; and what follows each hidden layer, Relu
    where `between` is too short. *)
Record part := Part { hidden : list layerD; outer : layerD; clamp : list (dyadic * dyadic);
  between : list activation }.
Definition no_part := Part [] ([], []) [] [].
Definition all_relu (p : part) : Prop := Forall (eq Relu) (between p).
Definition part_at (ps : list part) (k : nat) : part := nth k ps no_part.
Definition layers (p : part) : list layerD := hidden p ++ [outer p].
Definition inputs_of (p : part) : nat := length (hd [] (fst (hd (outer p) (hidden p)))).

Open Scope R_scope.
Definition real_layer (l : layerD) := (map (map real) (fst l), map real (snd l)).
Fixpoint clamped (c : list (dyadic * dyadic)) (x : list R) : list R :=
  match c, x with
  | (low, high) :: c', a :: x' => Rmin (Rmax a (real low)) (real high) :: clamped c' x'
  | _, _ => x
  end.
Fixpoint layer_by_layer (between : list activation) (hidden : list layer) (last : layer) (x : list R) : list R :=
  match hidden with
  | [] => affine (fst last) (snd last) x
  | l :: hidden' =>
      layer_by_layer (tl between) hidden' last (activated (hd Relu between) (affine (fst l) (snd l) x))
  end.
Definition unclamped (p : part) : list R -> list R :=
  layer_by_layer (between p) (map real_layer (hidden p)) (real_layer (outer p)).
Definition value (p : part) (x : list R) : list R := unclamped p (clamped (clamp p) x).
Definition vector_sum (us : list (list R)) : list R := fold_right plusR [] us.

(** "network", "phi:..." or "rho:...", and "set:...", whose value is rho(phi(x) + rest). *)
Inductive function := Alone (p : nat) | Set_of (phi rho : nat).
Definition moved (f : function) : nat := match f with Alone p => p | Set_of phi _ => phi end.
Definition value_of (ps : list part) (f : function) (rest x : list R) : list R :=
  match f with
  | Alone p => value (part_at ps p) x
  | Set_of phi rho => value (part_at ps rho) (plusR (value (part_at ps phi) x) rest)
  end.

(** A set function may be silent: 0 where just these networks' terms, in any order and as often as listed, make up the
    sum. `those`: the networks of the terms that are there; `sum`: the sum of their terms. *)
Definition zeros (n : nat) : list R := repeat 0 n.
Definition count_of (p : nat) (those : list nat) : nat := length (filter (Nat.eqb p) those).
Definition same_terms (a b : list nat) : bool := forallb (fun p => count_of p a =? count_of p b)%nat (a ++ b).
Definition is_silent (silent : list (list nat)) (those : list nat) : bool := existsb (same_terms those) silent.
Definition outputs_of (p : part) : nat := length (fst (outer p)).
Definition unless_silent (ps : list part) (silent : list (list nat)) (rho : nat) (those : list nat) (sum : list R) :=
  if is_silent silent those then zeros (outputs_of (part_at ps rho)) else value (part_at ps rho) sum.

(** Of equal length, and different only where `moves` says true. *)
Fixpoint agree (moves : list bool) (x y : list R) : Prop :=
  match moves, x, y with
  | m :: moves', a :: x', b :: y' => (m = true \/ a = b) /\ agree moves' x' y'
  | [], [], [] => True
  | _, _, _ => False
  end.
(** The sum of ((x_k - y_k) / scale_k)^2, its root; a scale that is left out is 1. *)
Definition one : dyadic := (1, 0)%Z.
Fixpoint square_in (scale : list dyadic) (d : list R) : R :=
  match d with [] => 0 | a :: d' => (a / real (hd one scale)) * (a / real (hd one scale)) + square_in (tl scale) d'
    end.
Definition distance (scale : list dyadic) (x y : list R) : R := sqrt (square_in scale (minus x y)).

(** Several terms of the sum move: of kind k (phi, moves, count) at most `count`, each from `fst` to `snd`. *)
Definition kind := (nat * list bool * Z)%type.
Definition mover := (list R * list R)%type.
Definition may_move (k : kind) (ms : list mover) : Prop :=
  (Z.of_nat (length ms) <= snd k)%Z /\ Forall (fun m => agree (snd (fst k)) (fst m) (snd m)) ms.
Definition terms (ps : list part) (side : mover -> list R) (group : kind * list mover) : list (list R) :=
  map (fun m => value (part_at ps (fst (fst (fst group)))) (side m)) (snd group).
Definition sum_at (ps : list part) (side : mover -> list R) (groups : list (kind * list mover)) : list R :=
  vector_sum (flat_map (terms ps side) groups).
Definition step_of (m : mover) : R := norm (minus (fst m) (snd m)).

(** At most u times the norm of all steps together or, if not stacked, of the longest. *)
Definition bounded_change (stacked : bool) (u : dyadic) (change : list R) (movers : list mover) : Prop :=
  if stacked then norm change <= real u * norm (map step_of movers)
  else forall r, 0 <= r -> Forall (fun m => step_of m <= r) movers -> norm change <= real u * r.

(** Values over boxes of inputs: an interval for each number. *)
Definition box := list (dyadic * dyadic).
Fixpoint within (b : box) (x : list R) : Prop :=
  match b, x with
  | (low, high) :: b', a :: x' => real low <= a <= real high /\ within b' x'
  | [], [] => True
  | _, _ => False
  end.
(** Each number of y off by at most that of r. *)
Fixpoint close (r : list dyadic) (x y : list R) : Prop :=
  match r, x, y with
  | e :: r', a :: x', b :: y' => Rabs (b - a) <= real e /\ close r' x' y'
  | [], [], [] => True
  | _, _, _ => False
  end.
(** Terms of a sum: of part `phi`, each input in the box, between `fewest` and `most` of them. *)
Record term := Term { phi : nat; inputs_in : box; fewest : Z; most : Z }.
Definition may_stand (t : term) (xs : list (list R)) : Prop :=
  (fewest t <= Z.of_nat (length xs) <= most t)%Z /\ Forall (within (inputs_in t)) xs.
Definition sum_of_terms (ps : list part) (rho : nat) (groups : list (term * list (list R))) : list R :=
  vector_sum (zeros (inputs_of (part_at ps rho)) ::
    flat_map (fun g => map (value (part_at ps (phi (fst g)))) (snd g)) groups).
Definition networks_in (groups : list (term * list (list R))) : list nat :=
  flat_map (fun g => map (fun _ => phi (fst g)) (snd g)) groups.
(** Single terms: of which network, and its input. *)
Definition single := (nat * list R)%type.
Definition sum_of_singles (ps : list part) (rho : nat) (terms : list single) : list R :=
  vector_sum (zeros (inputs_of (part_at ps rho)) :: map (fun t => value (part_at ps (fst t)) (snd t)) terms).
Definition set_value (ps : list part) (silent : list (list nat)) (rho : nat) (terms : list single) : list R :=
  unless_silent ps silent rho (map fst terms) (sum_of_singles ps rho terms).
Fixpoint box_of (boxes : list (nat * box)) (p : nat) : option box :=
  match boxes with [] => None | (q, b) :: boxes' => if (p =? q)%nat then Some b else box_of boxes' p end.
Definition in_its_box (boxes : list (nat * box)) (t : single) : Prop :=
  match box_of boxes (fst t) with Some b => within b (snd t) | None => False end.
(** v is what the float32 evaluation of part p returns for inputs x, if what reaches its first layer differs from the
    clamped x by at most r, number by number; `in_order`: with the sums of the layers in order. *)
Definition evaluates (in_order : bool) (p : part) (r : list dyadic) (x v : list R) : Prop :=
  exists h, close r (clamped (clamp p) x) h /\
    float_network in_order (map real_layer (hidden p)) (real_layer (outer p)) h v.
(** Number by number a float32 sum of these vectors, starting from zero. *)
Definition float_vector_sum (n : nat) (us : list (list R)) (s : list R) : Prop :=
  length s = n /\ forall i, (i < n)%nat -> float_sum (0 :: map (fun u => nth i u 0) us) (nth i s 0).

Inductive claim :=
| Norm_at_most (p layer : nat) (u : dyadic)
| Norm_at_least (p layer : nat) (l : dyadic)
| Slope_at_most (f : function) (moves : list bool) (scale : list dyadic) (u : dyadic)
| Slope_at_least (silent : list (list nat)) (f : function) (moves : list bool) (scale : list dyadic) (l : dyadic)
| Slope_in_box (f : function) (moves : list bool) (scale : list dyadic) (b : box) (u : dyadic)
| Law (stacked : bool) (kinds : list kind) (rho : nat) (u : dyadic)
| Law_in_box (stacked : bool) (kinds : list (kind * box)) (rho : nat) (u : dyadic)
| Within (p : nat) (b v : box)
| Sum_within (silent : list (list nat)) (terms : list term) (rho : nat) (v : box)
| Jump_at_most (phi : nat) (b : box) (rho : nat) (u : dyadic)
| Float_error (in_order : bool) (p : nat) (b : box) (r e : list dyadic) (u : dyadic)
| Sum_float_error (in_order : bool) (terms : list (term * list dyadic)) (rho : nat) (u : dyadic)
| Slope_among (phi rho : nat) (moves : list bool) (scale : list dyadic) (b : box) (others : list term) (u : dyadic)
| Law_among (stacked : bool) (kinds : list (kind * box * Z)) (rho : nat) (u : dyadic)
| Step_at_most (silent : list (list nat)) (boxes : list (nat * box)) (phi rho : nat) (u : dyadic).

Definition weights_at (ps : list part) (p layer : nat) : list (list R) :=
  map (map real) (fst (nth layer (layers (part_at ps p)) ([], []))).
Definition holds (ps : list part) (c : claim) : Prop :=
  match c with
  | Norm_at_most p layer u => forall d, norm (applyR (weights_at ps p layer) d) <= real u * norm d
  | Norm_at_least p layer l =>
      exists d, length d = length (hd [] (weights_at ps p layer)) /\ 0 < norm d /\
        real l * norm d <= norm (applyR (weights_at ps p layer) d)
  | Slope_at_most f moves scale u =>
      forall rest x y, agree moves x y -> length x = inputs_of (part_at ps (moved f)) ->
        norm (minus (value_of ps f rest x) (value_of ps f rest y)) <= real u * distance scale x y
  | Slope_in_box f moves scale b u =>
      forall rest x y, agree moves x y -> length x = inputs_of (part_at ps (moved f)) -> within b x -> within b y ->
        norm (minus (value_of ps f rest x) (value_of ps f rest y)) <= real u * distance scale x y
  | Slope_at_least silent f moves scale l =>
      exists others x y, agree moves x y /\ length x = inputs_of (part_at ps (moved f)) /\ 0 < distance scale x y /\
        Forall (fun o => length (snd o) = inputs_of (part_at ps (fst o))) others /\
        is_silent silent (moved f :: map fst others) = false /\
        let rest := vector_sum (map (fun o => value (part_at ps (fst o)) (snd o)) others) in
        real l * distance scale x y <= norm (minus (value_of ps f rest x) (value_of ps f rest y))
  | Law stacked kinds rho u =>
      forall movers, Forall2 may_move kinds movers -> let groups := combine kinds movers in
      Forall (fun g => Forall (fun m => length (fst m) = inputs_of (part_at ps (fst (fst (fst g))))) (snd g))
        groups ->
      bounded_change stacked u (minus (value (part_at ps rho) (sum_at ps fst groups))
        (value (part_at ps rho) (sum_at ps snd groups))) (concat movers)
  | Law_in_box stacked kinds rho u =>
      forall movers, Forall2 may_move (map fst kinds) movers ->
      Forall2 (fun k => Forall (fun m => within (snd k) (fst m) /\ within (snd k) (snd m))) kinds movers ->
      let groups := combine (map fst kinds) movers in
      Forall (fun g => Forall (fun m => length (fst m) = inputs_of (part_at ps (fst (fst (fst g))))) (snd g))
        groups ->
      bounded_change stacked u (minus (value (part_at ps rho) (sum_at ps fst groups))
        (value (part_at ps rho) (sum_at ps snd groups))) (concat movers)
  | Within p b v => forall x, within b x -> within v (value (part_at ps p) x)
  | Sum_within silent terms rho v =>
      forall inputs, Forall2 may_stand terms inputs -> let groups := combine terms inputs in
        within v (unless_silent ps silent rho (networks_in groups) (sum_of_terms ps rho groups))
  | Jump_at_most phi b rho u =>
      forall x rest, within b x -> length rest = inputs_of (part_at ps rho) ->
        norm (minus (value (part_at ps rho) (plusR (value (part_at ps phi) x) rest)) (value (part_at ps rho) rest))
          <= real u
  | Float_error in_order p b r e u =>
      all_relu (part_at ps p) /\
      forall x v, within b x -> evaluates in_order (part_at ps p) r x v ->
        close e (value (part_at ps p) x) v /\ norm (minus v (value (part_at ps p) x)) <= real u
  | Sum_float_error in_order terms rho u =>
      all_relu (part_at ps rho) /\ Forall (fun t => all_relu (part_at ps (phi (fst t)))) terms /\
      forall inputs computed s v, Forall2 may_stand (map fst terms) inputs ->
        Forall2 (fun t_xs vs =>
          Forall2 (evaluates in_order (part_at ps (phi (fst (fst t_xs)))) (snd (fst t_xs))) (snd t_xs) vs)
          (combine terms inputs) computed ->
        float_vector_sum (inputs_of (part_at ps rho)) (concat computed) s ->
        float_network in_order (map real_layer (hidden (part_at ps rho))) (real_layer (outer (part_at ps rho))) s v ->
        norm (minus v (value (part_at ps rho) (sum_of_terms ps rho (combine (map fst terms) inputs)))) <= real u
  | Slope_among p rho moves scale b others u =>
      forall inputs x y, Forall2 may_stand others inputs -> agree moves x y -> length x = inputs_of (part_at ps p) ->
        within b x -> within b y -> let term t := map (value (part_at ps (phi (fst t)))) (snd t) in
        let rest := vector_sum (flat_map term (combine others inputs)) in
        norm (minus (value_of ps (Set_of p rho) rest x) (value_of ps (Set_of p rho) rest y))
          <= real u * distance scale x y
  | Law_among stacked kinds rho u =>
      let movable := map (fun k => fst (fst k)) kinds in
      forall movers, Forall2 may_move movable movers ->
      Forall2 (fun k ms => (snd k <= Z.of_nat (length ms))%Z /\
        Forall (fun m => within (snd (fst k)) (fst m) /\ within (snd (fst k)) (snd m)) ms) kinds movers ->
      let groups := combine movable movers in
      Forall (fun g => Forall (fun m => length (fst m) = inputs_of (part_at ps (fst (fst (fst g))))) (snd g))
        groups ->
      bounded_change stacked u (minus (value (part_at ps rho) (sum_at ps fst groups))
        (value (part_at ps rho) (sum_at ps snd groups))) (concat movers)
  | Step_at_most silent boxes phi rho u =>
      forall x others, Forall (in_its_box boxes) ((phi, x) :: others) ->
        norm (minus (set_value ps silent rho ((phi, x) :: others)) (set_value ps silent rho others)) <= real u
  end.
