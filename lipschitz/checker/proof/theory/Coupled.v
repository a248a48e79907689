(** What the checker computes of set functions among a given number of neighbours: phi and rho as one network, the other
    terms as more inputs, in the intervals that trees of parts show. *)
From Coq Require Import List ZArith Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Blocks Lower Sets Values Parts.
Import ListNotations.

(** m more inputs, none of them negative, that pass through all layers, behind the others. *)
Fixpoint passing (n m : nat) (ls : list layerD) : list layerD :=
  match ls with
  | [] => []
  | (w, c) :: ls' =>
      (map (fun r => r ++ repeat zero m) w ++ map (fun i => unit_form (n + i)) (seq 0 m), c ++ repeat zero m)
      :: passing (length w) m ls'
  end.
(** The first layer of rho behind the last one of phi. *)
Definition joined_layer (phi : layerD) (rho : layerD) : layerD :=
  (product zero add mul (fst rho) (fst phi), plus add (apply zero add mul (fst rho) (snd phi)) (snd rho)).
Definition first_layer (p : part) : layerD := hd (outer p) (hidden p).
(** What rho's first layer makes of a term, without its biases. *)
Definition term_layer (phi rho : part) : layerD :=
  joined_layer (outer phi) (fst (first_layer rho), map (fun _ => zero) (fst (first_layer rho))).
Fixpoint with_units (w : matrixD) (n : nat) : matrixD :=
  match w with [] => [] | r :: w' => (r ++ unit_form n) :: with_units w' (S n) end.
(** rho (phi x + rest) of the inputs x and V rest - least, V being rho's first matrix. *)
Definition coupled (phi rho : part) (least : list dyadic) : part :=
  let (w, c) := joined_layer (outer phi) (first_layer rho) in
  Part (passing (inputs_of phi) (length w) (hidden phi) ++ (with_units w O, plus add c least) :: tl (hidden rho)) (outer
    rho) (clamp phi) [].

(** Whether the last layer's values lie in v, shown on the parts of a box. *)
Inductive range_tree :=
| Range_leaf (ds : list (list decision))
| Range_halves (ds : list (list decision)) (coordinate : nat) (middle : dyadic) (lower upper : range_tree).
Fixpoint all_before (ls : list layerD) (lines : list (list line)) (before : list (layerD * list line)) :=
  match ls, lines with l :: ls', a :: lines' => all_before ls' lines' ((l, a) :: before) | _, _ => before end.
Fixpoint ends_of (before : list (layerD * list line)) (w : matrixD) (c : list dyadic) (b : box) : box :=
  match w, c with
  | row :: w', a :: c' =>
      (neg (most before [] (map neg row) (neg a) b), most before [] row a b) :: ends_of before w' c' b
  | _, _ => []
  end.
(** With what is known of a larger part. *)
Fixpoint narrowed (known v : box) : box :=
  match known, v with
  | (l, h) :: known', (l', h') :: v' => (larger l l', if at_most h h' then h else h') :: narrowed known' v'
  | _, _ => v
  end.
Fixpoint check_range (o : hints) (ls : list layerD) (last : layerD) (b : box) (around : list (list line)) (known v :
  box)
    (t : range_tree) : bool :=
  match t with
  | Range_leaf ds =>
      match bounds o b [] ls around ds with
      | Some lines => contains v (narrowed known (ends_of (all_before ls lines []) (fst last) (snd last) b))
      | None => false
      end
  | Range_halves ds k m lower upper =>
      match bounds o b [] ls around ds with
      | Some lines =>
          let e := narrowed known (ends_of (all_before ls lines []) (fst last) (snd last) b) in
          check_range o ls last (cut k m false b) lines e v lower && check_range o ls last (cut k m true b) lines e v
            upper
      | None => false
      end
  end.
(** The intervals of V times the other terms' sum. *)
Fixpoint ends_of_terms (m : nat) (others : list term) (vs : list box) : option box :=
  match others, vs with
  | [], [] => Some (repeat (zero, zero) m)
  | Term _ _ low high :: others', v :: vs' =>
      match ends_of_terms m others' vs' with
      | Some s => if ((length v =? m)%nat && (0 <=? low)%Z && (low <=? high)%Z)%bool then Some (add_ends low high v s)
                  else None
      | None => None
      end
  | _, _ => None
  end.
(** Joins: the last layer takes as many numbers as come. *)
Definition joins (p : part) (n : nat) : bool :=
  (length (hd [] (fst (outer p))) =? outputs (map fst (hidden p)) n)%nat.
