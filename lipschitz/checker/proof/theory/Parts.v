(** What the checker computes of proofs by parts of a box: which neurons a box decides, by linear relaxation of ReLU,
  the
  inequality of one part, and the tree of parts that covers the box. *)
From Coq Require Import List ZArith Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Blocks Lower Values.
Import ListNotations.

(** Numbers that no theorem relies on: a slope above ReLU for the ends of an interval, a shorter number that is meant to
  be no less, and factors to try. *)
Record hints := Hints {
  slope_between : dyadic -> dyadic -> dyadic;
  rounded_up : dyadic -> dyadic;
  factor_number : nat -> matrixD -> option factor }.
Definition up (o : hints) (x : dyadic) : dyadic := let r := rounded_up o x in if at_most x r then r else x.

(** Of y before a ReLU: y >= 0; y <= 0; or low <= y <= high and relu y <= slope y + offset. *)
Inductive line := On | Off | Open (low high slope offset : dyadic).
Definition line_of (o : hints) (low high : dyadic) : line :=
  if is_nonnegative low then On else if is_nonnegative (neg high) then Off else
  let s := slope_between o low high in
  Open low high s (larger (add high (neg (mul s high))) (neg (mul s low))).

(** c relu y <= c' y + k, neuron by neuron.
  `below`: which open neurons are bounded from below by y, the others by 0; beyond
  its end, those whose interval reaches further above 0 than below. *)
Fixpoint through_relu (c : list dyadic) (lines : list line) (below : list bool) : list dyadic * dyadic :=
  match c, lines with
  | a :: c', l :: lines' =>
      let (d, k) := through_relu c' lines' (tl below) in
      match l with
      | On => (a :: d, k)
      | Off => (zero :: d, k)
      | Open low high s t =>
          if is_nonnegative a then (mul a s :: d, add (mul a t) k)
          else if hd (is_positive (add low high)) below then (a :: d, k) else (zero :: d, k)
      end
  | _, _ => ([], zero)
  end.
Fixpoint combined (z : list dyadic) (m : matrixD) : list dyadic :=
  match z, m with
  | a :: z', r :: m' => if (fst a =? 0)%Z then combined z' m' else plus add (scale mul a r) (combined z' m')
  | _, _ => []
  end.
(** A form in the inputs that is at least c h + k, h being what the layers `before` it, the last one first,
  make of them. *)
Fixpoint form_above (before : list (layerD * list line)) (below : list (list bool)) (c : list dyadic) (k : dyadic) :
    list dyadic * dyadic :=
  match before with
  | [] => (c, k)
  | (w, bias, lines) :: before' =>
      let (d, j) := through_relu c lines (hd [] below) in
      form_above before' (tl below) (combined d w) (add (add k j) (dot zero add mul d bias))
  end.
Definition most before below c k (b : box) : dyadic :=
  let (d, j) := form_above before below c k in add j (snd (row_ends d b)).

(** A neuron of a layer that is on or off, as shown by relaxation with these lower slopes, the layer before first. *)
Record decision := Decision { neuron : nat; is_on : bool; lower_slopes : list (list bool) }.
Section Bounds.
Context (o : hints) (b : box).
Definition new_line before (row : list dyadic) (bias : dyadic) (around : list line) : line :=
  let low := neg (up o (most before [] (map neg row) (neg bias) b)) in
  let high := up o (most before [] row bias b) in
  match around with
  | [] => line_of o low high
  | Open l h _ _ :: _ => line_of o (larger l low) (if at_most h high then h else high)
  | known :: _ => known
  end.
Fixpoint new_lines before (w : matrixD) (c : list dyadic) (around : list line) : list line :=
  match w, c with
  | row :: w', a :: c' => new_line before row a around :: new_lines before w' c' (tl around)
  | _, _ => []
  end.
Definition decide before (w : matrixD) (c : list dyadic) (lines : list line) (d : decision) : option (list line) :=
  match nth_error lines (neuron d) with
  | Some (Open _ _ _ _) =>
      let row := nth (neuron d) w [] in
      let bias := nth (neuron d) c zero in
      let end_ := if is_on d then most before (lower_slopes d) (map neg row) (neg bias) b
                  else most before (lower_slopes d) row bias b in
      if is_nonnegative (neg end_)
      then Some (firstn (neuron d) lines ++ (if is_on d then On else Off) :: skipn (S (neuron d)) lines) else None
  | Some _ => Some lines
  | None => None
  end.
Fixpoint decide_all before w c lines (ds : list decision) : option (list line) :=
  match ds with
  | [] => Some lines
  | d :: ds' => match decide before w c lines d with Some l => decide_all before w c l ds' | None => None end
  end.
(** Layer by layer; `around`: lines of a larger box. *)
Fixpoint bounds before (ls : list layerD) (around : list (list line)) (ds : list (list decision)) :
    option (list (list line)) :=
  match ls with
  | [] => Some []
  | (w, c) :: ls' =>
      match decide_all before w c (new_lines before w c (hd [] around)) (hd [] ds) with
      | None => None
      | Some l =>
          match bounds ((w, c, l) :: before) ls' (tl around) (tl ds) with Some r => Some (l :: r) | None => None end
      end
  end.
End Bounds.

(** Quadratic forms as sums of 2 (p v) (q v) for pairs of linear forms p, q. *)
Definition pair_of_forms := (list dyadic * list dyadic)%type.
Definition scale_short (a : dyadic) (u : list dyadic) : list dyadic := if (fst a =? 0)%Z then [] else scale mul a u.
(** Upper rows. *)
Fixpoint outer_sum_of (p q : list dyadic) : matrixD :=
  match p, q with
  | a :: p', b :: q' => (mul (1, 1)%Z (mul a b) :: plus add (scale_short a q') (scale_short b p')) :: outer_sum_of p' q'
  | _, _ => []
  end.
Definition quadratic (ps : list pair_of_forms) : matrixD :=
  fold_right (fun p s => sum add (outer_sum_of (fst p) (snd p)) s) [] ps.
Definition half (x : dyadic) : dyadic := shift (-1) x.
Definition unit_form (n : nat) : list dyadic := repeat zero n ++ [one].
(** -|y|^2. *)
Definition minus_squares (ys : matrixD) : list pair_of_forms := map (fun y => (map neg y, map half y)) ys.
(** The form of a lower triangle, whose rows end on the diagonal, times a sign. *)
Fixpoint half_last (u : list dyadic) : list dyadic :=
  match u with [] => [] | [a] => [half a] | a :: u' => a :: half_last u' end.
Fixpoint form_pairs (s : dyadic) (q : matrixD) (ys all : matrixD) : list pair_of_forms :=
  match q, ys with
  | r :: q', y :: ys' => (scale mul s y, combined (half_last r) all) :: form_pairs s q' ys' all
  | _, _ => []
  end.

(** Increments through a ReLU: those of y are linear forms `ys` in n variables so far;
  an open neuron's own increment is a
  new variable z, for which z (y - z) >= 0, times 2 t. *)
Definition is_open (l : line) : bool := match l with Open _ _ _ _ => true | _ => false end.
Fixpoint relu_step (lines : list line) (ts : list dyadic) (ys : matrixD) (n : nat) : list pair_of_forms * matrixD *
  nat :=
  match lines, ys with
  | l :: lines', y :: ys' =>
      let '(p, z, m) := relu_step lines' (tl ts) ys' (if is_open l then S n else n) in
      match l with
      | On => (p, y :: z, m)
      | Off => (p, [] :: z, m)
      | Open _ _ _ _ =>
          let e := unit_form n in
          ((scale mul (neg (hd zero ts)) e, plus add y (scale mul (-1, 0)%Z e)) :: p, e :: z, m)
      end
  | _, _ => ([], [], n)
  end.
Definition times_rows (w rows : matrixD) : matrixD := map (fun r => combined r rows) w.
Fixpoint chain_pairs (ls : list layerD) (lines : list (list line)) (ts : list (list dyadic)) (rows : matrixD) (n :
  nat) :
    list pair_of_forms * matrixD * list (matrixD * matrixD) :=
  match ls, lines with
  | (w, _) :: ls', l :: lines' =>
      let y := times_rows w rows in
      let '(p, z, m) := relu_step l (hd [] ts) y n in
      let '(q, last, all) := chain_pairs ls' lines' (tl ts) z m in (p ++ q, last, (y, z) :: all)
  | _, _ => ([], rows, [])
  end.
(** Two neurons that are not both in these states anywhere in a part, because weight y_1 + rest y_2 <= 0 there,
  y negated where
  the state is off. Where neither changes its sign, u_1 u_2 = 0 for u = dz (on) or dy - dz (off): times any number. *)
Record place := Place { in_layer : nat; in_row : nat; stays_on : bool }.
Record conflict := Conflict { first : place; second : place; weight : dyadic; rest : dyadic; times_product : dyadic }.
Definition signed (p : place) (row : list dyadic) : list dyadic := if stays_on p then row else map neg row.
Fixpoint lines_before (ls : list layerD) (lines : list (list line)) (before : list (layerD * list line)) (k : nat) :=
  match k, ls, lines with
  | S k', l :: ls', a :: lines' => lines_before ls' lines' ((l, a) :: before) k'
  | _, _, _ => before
  end.
Definition place_is_open (lines : list (list line)) (p : place) : bool :=
  match nth_error (nth (in_layer p) lines []) (in_row p) with Some l => is_open l | None => false end.
Definition no_layer : layerD := ([], []).
Definition form_of_place ls lines (p : place) : list dyadic * dyadic :=
  let (w, c) := nth (in_layer p) ls no_layer in
  let s := if stays_on p then one else (-1, 0)%Z in
  form_above (lines_before ls lines [] (in_layer p)) [] (scale mul s (nth (in_row p) w [])) (mul s (nth (in_row p) c
    zero)).
Definition is_shown (ls : list layerD) (lines : list (list line)) (b : box) (c : conflict) : bool :=
  let (f, k) := form_of_place ls lines (first c) in
  let (g, j) := form_of_place ls lines (second c) in
  place_is_open lines (first c) && place_is_open lines (second c)
  && is_nonnegative (weight c) && is_nonnegative (rest c) && is_positive (add (weight c) (rest c))
  && is_nonnegative (neg (add (add (mul (weight c) k) (mul (rest c) j))
       (snd (row_ends (plus add (scale mul (weight c) f) (scale mul (rest c) g)) b)))).
Definition increment_form (all : list (matrixD * matrixD)) (p : place) : list dyadic :=
  let (y, z) := nth (in_layer p) all ([], []) in
  let z_row := nth (in_row p) z [] in
  if stays_on p then z_row else plus add (nth (in_row p) y []) (scale mul (-1, 0)%Z z_row).
Definition conflict_pairs (all : list (matrixD * matrixD)) (cs : list conflict) : list pair_of_forms :=
  map (fun c => (scale mul (neg (times_product c)) (increment_form all (first c)), increment_form all (second c))) cs.
(** By one of the factors with the numbers from k on. *)
Fixpoint shown_by (factor_of : nat -> matrixD -> option factor) (tries k : nat) (p : matrixD) : bool :=
  match tries with
  | O => false
  | S tries' =>
      match factor_of k p with
      | Some f => if shows_nonnegative p f then true else shown_by factor_of tries' (S k) p
      | None => false
      end
  end.
Definition most_factors : nat := 20.
Definition input_pairs (rho : dyadic) (n : nat) : list pair_of_forms :=
  map (fun k => (unit_form k, scale mul (half rho) (unit_form k))) (seq 0 n).
Definition output_pairs (form : option matrixD) (out : matrixD) : list pair_of_forms :=
  match form with None => minus_squares out | Some q => form_pairs (-1, 0)%Z q out out end.
(** rho |dx|^2 - |df|^2 or, with a form, rho |dx|^2 - df' q df is not negative in the part. *)
Definition part_inequality (ls : list layerD) (last : layerD) (form : option matrixD) (moves : list bool)
    (scale : list dyadic) (rho : dyadic) (lines : list (list line)) (cs : list conflict) (ts : list dyadic) : matrixD :=
  let '(p, z, all) := chain_pairs ls lines (split ts (map fst ls)) (selector moves scale) (count moves) in
  let out := times_rows (fst last) z in
  quadratic (input_pairs rho (count moves) ++ p ++ conflict_pairs all cs ++ output_pairs form out).

(** v' q v - |rho v|^2 is not negative for increments v, whatever rho's neurons do. *)
Definition anything (l : layerD) : list line := repeat (Open zero zero zero zero) (length (fst l)).
Definition form_inequality (p : part) (q : matrixD) (ts : list dyadic) : matrixD :=
  let n := inputs_of p in
  let rows := map unit_form (seq 0 n) in
  let '(s, z, _) := chain_pairs (hidden p) (map anything (hidden p)) (split ts (map fst (hidden p))) rows n in
  quadratic (form_pairs one q rows rows ++ s ++ minus_squares (times_rows (fst (outer p)) z)).

(** With its multipliers and factors. *)
Record proved_form := Proved_form { lower_rows : matrixD; form_multipliers : list dyadic;
  form_factor : nat -> matrixD -> option factor }.
Definition check_form (p : part) (f : proved_form) : bool :=
  forallb is_nonnegative (form_multipliers f)
  && shown_by (form_factor f) most_factors O (form_inequality p (lower_rows f) (form_multipliers f)).

(** Halves of boxes, and what proves the parts that are left: multipliers. *)
Inductive tree :=
| Leaf (ds : list (list decision)) (cs : list conflict) (t : list dyadic)
| Halve (ds : list (list decision)) (coordinate : nat) (middle : dyadic) (lower upper : tree).
Fixpoint cut (k : nat) (m : dyadic) (is_upper : bool) (b : box) : box :=
  match k, b with
  | _, [] => []
  | O, (l, h) :: b' => (if is_upper then (m, h) else (l, m)) :: b'
  | S k', i :: b' => i :: cut k' m is_upper b'
  end.
Fixpoint check_tree (o : hints) (ls : list layerD) (inequality : list (list line) -> list conflict -> list dyadic ->
  matrixD) (b : box)
    (around : list (list line)) (t : tree) : bool :=
  match t with
  | Leaf ds cs ts =>
      match bounds o b [] ls around ds with
      | Some lines => forallb is_nonnegative ts &&
        shown_by (factor_number o) most_factors O (inequality lines (filter (is_shown ls lines b) cs) ts)
      | None => false
      end
  | Halve ds k m lower upper =>
      match bounds o b [] ls around ds with
      | Some lines =>
          check_tree o ls inequality (cut k m false b) lines lower &&
            check_tree o ls inequality (cut k m true b) lines upper
      | None => false
      end
  end.

(** All inputs. A last input s is multiplied by the biases, and passes through all layers but the last: at s = 1 the
  numbers are those of x, and at (a x, a), a > 0, all of them are a times as large. *)
Fixpoint widened (w : matrixD) (c : list dyadic) : matrixD :=
  match w, c with r :: w', a :: c' => (r ++ [a]) :: widened w' c' | _, _ => [] end.
Fixpoint homogeneous (n : nat) (ls : list layerD) : list layerD :=
  match ls with
  | [] => []
  | (w, c) :: ls' =>
      let wide := widened w c ++ match ls' with [] => [] | _ => [unit_form n] end in
      (wide, map (fun _ => zero) wide) :: homogeneous (length w) ls'
  end.
(** Every row is as long as the layer's inputs are many. *)
Fixpoint is_chain (n : nat) (ls : list layerD) : bool :=
  match ls with [] => true | (w, _) :: ls' => forallb (fun r => length r =? n)%nat w && is_chain (length w) ls' end.
(** The face at s of coordinate k of the box of this radius, the last input in [0, 1]. *)
Definition face (radius : list dyadic) (k : nat) (s : dyadic) : box :=
  let n := length radius in
  map (fun j => if (j =? k)%nat then (s, s) else if (j =? n)%nat then (zero, one)
                else (neg (nth j radius zero), nth j radius zero)) (seq 0 (S n)).
(** One of them has a multiple of every (x, 1). *)
Definition all_faces (radius : list dyadic) : list box :=
  let n := length radius in
  face radius n one ::
  flat_map (fun k => [face radius k (neg (nth k radius zero)); face radius k (nth k radius zero)]) (seq 0 n).
Fixpoint check_trees (o : hints) (ls : list layerD) inequality (bs : list box) (ts : list tree) : bool :=
  match bs, ts with
  | [], [] => true
  | b :: bs', t :: ts' => check_tree o ls inequality b [] t && check_trees o ls inequality bs' ts'
  | _, _ => false
  end.
