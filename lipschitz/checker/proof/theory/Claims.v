(** The checker of claims, and what its acceptance means: `step_sound`. *)
From Coq Require Import List ZArith Reals Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Blocks Lower Values
  Enclosures Derivatives Centred Parts Coupled.
Import ListNotations.

Inductive proof :=
| By_inequality (rho : dyadic) (t : list dyadic) (f : factor)
| By_vector (v : list dyadic)
| By_product
| By_local_product
| By_local_inequality (rho : dyadic) (t : list dyadic) (f : factor)
| By_points (x y : list dyadic) (others : list (nat * list dyadic))
| By_triangle
| By_parts (rho : dyadic) (form : option proved_form) (o : hints) (t : tree)
| By_all_parts (rho : dyadic) (form : option proved_form) (o : hints) (radius : list dyadic) (ts : list tree)
| By_layers (bounds : list box)
| By_sum (sums : box)
| By_norm
| By_roundings (bounds : list box) (errors : list (list dyadic)) (moved : dyadic) (offs : list dyadic) (made : dyadic)
| By_rounded_sum (sums : box) (errors : list dyadic)
| By_steps (sums : list box)
| By_parts_among (rho : dyadic) (o : hints) (ranges : list (box * range_tree)) (t : tree)
| By_halves (k : nat) (m : dyadic).

Definition is_nil {A} (l : list A) : bool := match l with [] => true | _ => false end.
Definition matrix_at (ps : list part) (p layer : nat) : matrixD := fst (nth layer (layers (part_at ps p)) ([], [])).

(** |W v| >= l |v|. *)
Definition check_norm_below (w : matrixD) (l : dyadic) (v : list dyadic) : bool :=
  (length v =? length (hd [] w))%nat && is_nonnegative l && is_positive (squareD v)
  && at_most (mul (mul l l) (squareD v)) (squareD (apply zero add mul w v)).

(** Slopes by a matrix inequality. *)
Definition fits_part (p : part) : bool := forallb (fun l => length (snd l) =? length (fst l))%nat (layers p).
(** Each hidden layer with what follows it. *)
Fixpoint following {A} (between : list activation) (hidden : list A) : list (activation * A) :=
  match hidden with [] => [] | l :: hidden' => (hd Relu between, l) :: following (tl between) hidden' end.
(** What each number is divided by that leaves a layer with these rows; what stays is not. *)
Definition units {A} (a : activation) (rows : list A) : list dyadic :=
  by_number (fun b _ => unit_of b) (fun _ => one) a rows.
Definition scale_columns (b : list dyadic) (m : matrixD) : matrixD := map (times mul b) m.
(** Of the network whose functions are divided by b_k = units, B_k = diag (b_k): M_1, M_2 B_1, M_3 B_2, ... `b`: of the
    function in front. *)
Fixpoint scaled_matrices (b : list dyadic) (between : list activation) (later : list layerD) (last : layerD) : stack :=
  match later with
  | [] => ([], scale_columns b (fst last))
  | l :: later' =>
      let rest := scaled_matrices (units (hd Relu between) (fst l)) (tl between) later' last in
      (scale_columns b (fst l) :: fst rest, snd rest)
  end.
Definition matrices (p : part) : stack :=
  match hidden p with
  | [] => ([], fst (outer p))
  | first :: later =>
      let rest := scaled_matrices (units (hd Relu (between p)) (fst first)) (tl (between p)) later (outer p) in
      (fst first :: fst rest, snd rest)
  end.
(** Of each hidden neuron, the range of the layer's function, divided or not. *)
Definition divided_ranges {A} (a : activation) (rows : list A) : list rangeD :=
  map (fun _ => divided_range (base a)) rows.
Definition whole_ranges {A} (a : activation) (rows : list A) : list rangeD :=
  by_number (fun b _ => range_of b) (fun _ => kept_range) a rows.
(** Of each hidden layer: what is sorted in groups is known by group. *)
Definition relation_by (ranges : activation -> matrixD -> list rangeD) (a : activation) (rows : matrixD) : relationD :=
  match a with Sorted (Groups k) => Grouped (length rows / k) k | _ => Each (ranges a rows) end.
Definition relations_by (ranges : activation -> matrixD -> list rangeD) (p : part) : list relationD :=
  map (fun l => relation_by ranges (fst l) (fst (snd l))) (following (between p) (hidden p)).
Definition relu_between (p : part) : bool := forallb is_relu (between p).
Definition entrywise_between (p : part) : bool := forallb changes_numbers (between p).
(** Number by number, or sorted in groups that make up the layer. *)
Definition chained {A} (a : activation) (rows : list A) : bool :=
  match a with Sorted (Groups k) => (length rows =? length rows / k * k)%nat | _ => changes_numbers a end.
Definition chained_between (p : part) : bool :=
  forallb (fun l => chained (fst l) (fst (snd l))) (following (between p) (hidden p)).
(** The same network where pairs are sorted side by side: of halves, rows of the layer in front change places, and of
    halves and neighbours, columns of the layer behind. *)
Fixpoint interleaved {A} (u v : list A) : list A :=
  match u, v with a :: u', b :: v' => a :: b :: interleaved u' v' | _, _ => [] end.
Definition by_pairs {A} (l : list A) : list A :=
  let h := Nat.div2 (length l) in interleaved (firstn h l) (skipn h l).
Definition turned {A} (row : list A) : list A :=
  let h := Nat.div2 (length row) in interleaved (skipn h row) (firstn h row).
Definition turned_if {A} (b : bool) (m : list (list A)) : list (list A) := if b then map turned m else m.
Fixpoint regrouped_layers (turn : bool) (between : list activation) (hidden : list layerD) (last : layerD) :
    list activation * (list layerD * layerD) :=
  match hidden with
  | [] => ([], ([], (turned_if turn (fst last), snd last)))
  | (m, b) :: hidden' =>
      let m' := turned_if turn m in
      let '(a, l, is_turned) :=
        match hd Relu between with
        | Sorted Halves => (Sorted (Groups 2), (by_pairs m', by_pairs b), true)
        | Sorted Pairs => (Sorted (Groups 2), (m', b), true)
        | a => (a, (m', b), false)
        end in
      let rest := regrouped_layers is_turned (tl between) hidden' last in
      (a :: fst rest, (l :: fst (snd rest), snd (snd rest)))
  end.
Definition regrouped (p : part) : part :=
  let r := regrouped_layers false (between p) (hidden p) (outer p) in
  Part (fst (snd r)) (snd (snd r)) (clamp p) (fst r).
Fixpoint turns_fit (between : list activation) (hidden : list layerD) (last : layerD) : bool :=
  match hidden with
  | [] => true
  | (m, _) :: hidden' =>
      match hd Relu between with
      | Sorted Halves | Sorted Pairs =>
          Nat.even (length m) && forallb (fun r => length r =? length m)%nat (fst (hd last hidden'))
      | _ => true
      end && turns_fit (tl between) hidden' last
  end.
Definition may_regroup (p : part) : bool := fits_part p && turns_fit (between p) (hidden p) (outer p).
Definition parts_of (ps : list part) (f : function) : list part :=
  match f with Alone p => [part_at ps p] | Set_of phi rho => [part_at ps phi; part_at ps rho] end.
(** Every network's biases fit; rho has no clamp; `moves` and a scale that is stated have one entry per input. *)
Definition well_formed (ps : list part) (f : function) (moves : list bool) (scale : list dyadic) : bool :=
  forallb fits_part (parts_of ps f) && forallb (fun p => is_nil (clamp p)) (tl (parts_of ps f))
  && (length moves =? inputs_of (part_at ps (moved f)))%nat
  && positive_scale scale && (is_nil scale || (length scale =? length moves)%nat).
Definition check_slope ps f moves scale u rho t factor : bool :=
  let qs := map regrouped ps in
  forallb may_regroup (parts_of ps f)
  && (well_formed qs f moves scale && forallb chained_between (parts_of qs f) && is_nonnegative u
  && check_parts (flat_map (relations_by divided_ranges) (parts_of qs f)) ([], selector moves scale)
       (map matrices (parts_of qs f)) u rho t factor).

(** Slopes by products of norms that were accepted before. *)
Fixpoint find_norm (accepted : list claim) (p layer : nat) : option dyadic :=
  match accepted with
  | [] => None
  | Norm_at_most q k u :: rest => if ((p =? q) && (layer =? k))%nat%bool then Some u else find_norm rest p layer
  | _ :: rest => find_norm rest p layer
  end.
Fixpoint norms (accepted : list claim) (p layer : nat) (ls : list layerD) : option dyadic :=
  match ls with
  | [] => Some one
  | _ :: ls' =>
      match find_norm accepted p layer, norms accepted p (S layer) ls' with
      | Some u, Some v => if is_nonnegative u then Some (mul u v) else None
      | _, _ => None
      end
  end.
(** Times the largest slope of each function between layers. *)
Definition with_slopes {A} (between : list activation) (hidden : list A) (u : dyadic) : dyadic :=
  fold_right (fun l v => mul (steepest (fst l)) v) u (following between hidden).
Definition norm_of (ps : list part) (accepted : list claim) (p : nat) : option dyadic :=
  let q := part_at ps p in option_map (with_slopes (between q) (hidden q)) (norms accepted p O (layers q)).
Fixpoint largest (m : dyadic) (scale : list dyadic) : dyadic :=
  match scale with [] => m | s :: scale' => largest (if at_most m s then s else m) scale' end.
(** What is behind the part that moves. *)
Definition behind_of (ps : list part) (accepted : list claim) (f : function) : option dyadic :=
  match f with Alone _ => Some one | Set_of _ rho => norm_of ps accepted rho end.
(** `first`: a bound of the part that moves. *)
Definition check_product_with ps accepted f moves scale u (first : option dyadic) : bool :=
  let m := largest (hd one scale) scale in
  well_formed ps f moves scale && at_most (hd one scale) m && forallb (fun s => at_most s m) scale
  && match first, behind_of ps accepted f with Some a, Some b => at_most (mul m (mul a b)) u | _, _ => false end.
Definition check_product ps accepted f moves scale u : bool :=
  check_product_with ps accepted f moves scale u (norm_of ps accepted (moved f)).

(** The same in a box, with the largest slope that the functions of the part that moves have there. *)
Fixpoint steepest_known (a : activation) (s : list known) : dyadic :=
  match a with
  | Sorted _ => one
  | Keeping n b => larger one (steepest_known b (firstn n s))
  | _ => fold_right (fun n m => let (l, h) := slopes_between a (fst n) in larger (larger h (neg l)) m) zero s
  end.
Fixpoint steepest_centred (radius : list dyadic) (rounding : dyadic) (between : list activation) (hidden : list layerD)
    (s : list known) : dyadic :=
  match hidden with
  | [] => one
  | l :: hidden' =>
      let t := passed radius rounding (fst l) (snd l) s in
      let a := hd Relu between in
      mul (steepest_known a t)
        (steepest_centred radius rounding (tl between) hidden' (activated_known a rounding t))
  end.
Definition steepest_on_box (p : part) (b : box) : dyadic :=
  let c := clamp_ends (clamp p) b in
  let radius := radius_of c in
  steepest_centred radius (rounding_of radius) (between p) (hidden p) (inputs_known 0 c).
Definition check_local_product ps accepted f moves scale (b : box) u : bool :=
  let p := part_at ps (moved f) in
  check_product_with ps accepted f moves scale u
    (option_map (mul (steepest_on_box p b)) (norms accepted (moved f) O (layers p))).

(** In a box, by a matrix inequality with the slopes that each neuron of the part that moves has there; no function is
  divided. Behind it, terms of a sum may be anything. *)
Definition slopes_known : activation -> list known -> list rangeD :=
  by_number (fun b n => slopes_between b (fst n)) (fun _ => kept_range).
Fixpoint ranges_centred (radius : list dyadic) (rounding : dyadic) (between : list activation) (hidden : list layerD)
    (s : list known) : list (list rangeD) :=
  match hidden with
  | [] => []
  | l :: hidden' =>
      let t := passed radius rounding (fst l) (snd l) s in
      let a := hd Relu between in
      slopes_known a t
      :: ranges_centred radius rounding (tl between) hidden' (activated_known a rounding t)
  end.
Definition ranges_on_box (p : part) (b : box) : list (list rangeD) :=
  let c := clamp_ends (clamp p) b in
  let radius := radius_of c in
  ranges_centred radius (rounding_of radius) (between p) (hidden p) (inputs_known 0 c).
(** Of each part. *)
Definition local_relations (ps : list part) (f : function) (b : box) : list (list relationD) :=
  map Each (ranges_on_box (part_at ps (moved f)) b)
  :: match f with Alone _ => [] | Set_of _ rho => [relations_by whole_ranges (part_at ps rho)] end.
Definition undivided_matrices (p : part) : stack := (map fst (hidden p), fst (outer p)).
Definition check_local_slope ps f moves scale (b : box) u rho t factor : bool :=
  well_formed ps f moves scale && forallb entrywise_between (parts_of ps f)
  && is_nonnegative u
  && check_parts (concat (local_relations ps f b)) ([], selector moves scale) (map undivided_matrices (parts_of ps f)) u
       rho t factor.

(** Slopes in a box, part by part. *)
Definition check_parts_with ps f moves scale u r (form : option proved_form) (covers : option matrixD -> bool) : bool :=
  well_formed ps f moves scale && forallb relu_between (parts_of ps f) && is_nonnegative u && at_most r (mul u u)
  && match f, form with
     | Alone _, None => covers None
     | Set_of _ rho, Some q =>
         (length (fst (outer (part_at ps (moved f)))) =? inputs_of (part_at ps rho))%nat &&
           check_form (part_at ps rho) q
         && covers (Some (lower_rows q))
     | _, _ => false
     end.
Definition check_parts_of_box ps f moves scale (b : box) u r form (o : hints) (t : tree) : bool :=
  let p := part_at ps (moved f) in
  check_parts_with ps f moves scale u r form (fun q =>
    check_tree o (hidden p) (part_inequality (hidden p) (outer p) q moves scale r) (clamp_ends (clamp p) b) [] t).
(** The same for all inputs. *)
Definition check_parts_of_all ps f moves scale u r form (o : hints) (radius : list dyadic) (ts : list tree) : bool :=
  let p := part_at ps (moved f) in let n := inputs_of p in let ls := homogeneous n (hidden p) in
  negb (is_nil (hidden p)) && is_chain n (hidden p) && (length radius =? n)%nat && forallb is_positive radius
  && check_parts_with ps f moves scale u r form (fun q =>
    check_trees o ls (part_inequality ls (outer p) q (moves ++ [false]) scale r) (all_faces radius) ts).

(** In a box among a given number of neighbours. *)
Definition check_term_range ps rho (o : hints) (t : term) (v : box * range_tree) : bool :=
  let p := part_at ps (phi t) in
  fits_part p && relu_between p && joins p (length (inputs_in t))
  && check_range o (hidden p) (term_layer p (part_at ps rho)) (clamp_ends (clamp p) (inputs_in t)) [] [] (fst v)
       (snd v).
Fixpoint check_term_ranges ps rho (o : hints) (others : list term) (vs : list (box * range_tree)) : bool :=
  match others, vs with
  | [], [] => true
  | t :: others', v :: vs' => check_term_range ps rho o t v && check_term_ranges ps rho o others' vs'
  | _, _ => false
  end.
Definition check_slope_among ps p rho moves scale (b : box) others u r (o : hints) (ranges : list (box * range_tree))
    (t : tree) : bool :=
  let f := part_at ps p in
  let g := part_at ps rho in
  let n := inputs_of f in
  let m := length (fst (first_layer g)) in
  fits_part f && relu_between f && (length (clamp f) <=? n)%nat && joins f n && negb (is_nil (hidden f)) && is_chain
    n (hidden f)
  && fits_part g && relu_between g && is_nil (clamp g) && negb (is_nil (hidden g))
  && (length moves =? n)%nat && check_term_ranges ps rho o others ranges
  && match ends_of_terms m others (map fst ranges) with
     | Some s =>
         check_parts_of_box [coupled f g (map fst s)] (Alone 0) (moves ++ repeat false m)
           (if is_nil scale then [] else scale ++ repeat one m)
           (b ++ map (fun i => (zero, add (snd i) (neg (fst i)))) s) u r None o t
     | None => false
     end.

(** Slopes from below, between two points. *)
Definition value_ends (p : part) (b : box) : box :=
  network_ends (between p) (hidden p) (outer p) (clamp_ends (clamp p) b).
Definition value_of_ends (ps : list part) (f : function) (rest x : box) : box :=
  match f with
  | Alone p => value_ends (part_at ps p) x
  | Set_of phi rho => value_ends (part_at ps rho) (plus_ends (value_ends (part_at ps phi) x) rest)
  end.
Definition at_point (x : list dyadic) : box := map (fun a => (a, a)) x.
(** At most the square of the distance of any two vectors in a and b. *)
Fixpoint least_square (a b : box) : dyadic :=
  match a, b with
  | (l, h) :: a', (m, k) :: b' =>
      let d := larger zero (larger (add l (neg k)) (add m (neg h))) in add (mul d d) (least_square a' b')
  | _, _ => zero
  end.
Fixpoint agreeD (moves : list bool) (x y : list dyadic) : bool :=
  match moves, x, y with
  | m :: moves', a :: x', b :: y' => (m || (fst (add a (neg b)) =? 0)%Z) && agreeD moves' x' y'
  | [], [], [] => true
  | _, _, _ => false
  end.
(** square_in as a fraction. *)
Fixpoint fraction_in (scale : list dyadic) (d : list dyadic) : dyadic * dyadic :=
  match d with
  | [] => (zero, one)
  | a :: d' =>
      let s := hd one scale in
      let (n, m) := fraction_in (tl scale) d' in (add (mul n (mul s s)) (mul (mul a a) m), mul m (mul s s))
  end.
Definition check_points ps silent f moves scale l x y others : bool :=
  let rest := fold_right plus_ends [] (map (fun o => value_ends (part_at ps (fst o)) (at_point (snd o))) others) in
  let (n, m) := fraction_in scale (minusD x y) in
  negb (is_silent silent (moved f :: map fst others))
  && positive_scale scale && is_nonnegative l && agreeD moves x y && (length x =? inputs_of (part_at ps (moved f)))%nat
  && forallb (fun o => length (snd o) =? inputs_of (part_at ps (fst o)))%nat others && is_positive n
  && at_most (mul (mul l l) n)
       (mul (least_square (value_of_ends ps f rest (at_point x)) (value_of_ends ps f rest (at_point y))) m).

(** Laws: one term of the sum after the other. *)
Fixpoint same_moves (a b : list bool) : bool :=
  match a, b with x :: a', y :: b' => Bool.eqb x y && same_moves a' b' | [], [] => true | _, _ => false end.
(** The least that was accepted. *)
Fixpoint find_slope (accepted : list claim) (phi rho : nat) (moves : list bool) : option dyadic :=
  match accepted with
  | [] => None
  | Slope_at_most (Set_of q k) m [] u :: rest =>
      let others := find_slope rest phi rho moves in
      if ((phi =? q) && (rho =? k))%nat%bool && same_moves moves m
      then match others with Some v => if at_most v u then Some v else Some u | None => Some u end else others
  | _ :: rest => find_slope rest phi rho moves
  end.
(** Sum of n k^power, and whether every kind has its bound and a count that is not negative. *)
Fixpoint total_of (accepted : list claim) (squares : bool) (kinds : list kind) (rho : nat) : option dyadic :=
  match kinds with
  | [] => Some zero
  | (phi, moves, n) :: kinds' =>
      match find_slope accepted phi rho moves, total_of accepted squares kinds' rho with
      | Some k, Some rest =>
          if is_nonnegative k && (0 <=? n)%Z then Some (add (mul (n, 0%Z) (if squares then mul k k else k)) rest)
              else None
      | _, _ => None
      end
  end.
Definition check_law ps accepted (stacked : bool) kinds rho u : bool :=
  is_nonnegative u && fits_part (part_at ps rho)
  && match total_of accepted stacked kinds rho with
     | Some s => at_most s (if stacked then mul u u else u)
     | None => false
     end.

(** The least bound that was accepted for this box, or for all inputs. *)
Definition less_of (u : dyadic) (v : option dyadic) : option dyadic :=
  match v with Some w => if at_most w u then Some w else Some u | None => Some u end.
Fixpoint find_slope_in (accepted : list claim) (phi rho : nat) (moves : list bool) (b : box) : option dyadic :=
  match accepted with
  | [] => None
  | Slope_at_most (Set_of q k) m [] u :: rest =>
      let others := find_slope_in rest phi rho moves b in
      if ((phi =? q) && (rho =? k))%nat%bool && same_moves moves m then less_of u others else others
  | Slope_in_box (Set_of q k) m [] c u :: rest =>
      let others := find_slope_in rest phi rho moves b in
      if ((phi =? q) && (rho =? k))%nat%bool && same_moves moves m && same_box b c then less_of u others else others
  | _ :: rest => find_slope_in rest phi rho moves b
  end.
Fixpoint total_in (accepted : list claim) (squares : bool) (kinds : list (kind * box)) (rho : nat) : option dyadic :=
  match kinds with
  | [] => Some zero
  | ((phi, moves, n), b) :: kinds' =>
      match find_slope_in accepted phi rho moves b, total_in accepted squares kinds' rho with
      | Some k, Some rest =>
          if is_nonnegative k && (0 <=? n)%Z then Some (add (mul (n, 0%Z) (if squares then mul k k else k)) rest)
              else None
      | _, _ => None
      end
  end.
Definition check_law_in_box ps accepted (stacked : bool) kinds rho u : bool :=
  is_nonnegative u && fits_part (part_at ps rho)
  && match total_in accepted stacked kinds rho with
     | Some s => at_most s (if stacked then mul u u else u)
     | None => false
     end.

(** Among a given number of neighbours: of each kind, with its box and the fewest there may be, the others of its
  own and
    of the other kinds. *)
Definition term_among (less : Z) (k : kind * box * Z) : term :=
  let least := (snd k - less)%Z in
  Term (fst (fst (fst (fst k)))) (snd (fst k)) (if (0 <=? least)%Z then least else 0%Z) (snd (fst (fst k)) - less).
Definition others_of (before : list (kind * box * Z)) (k : kind * box * Z) (after : list (kind * box * Z)) : list
  term :=
  map (term_among 0) before ++ term_among 1 k :: map (term_among 0) after.
Fixpoint same_terms_in_boxes (a b : list term) : bool :=
  match a, b with
  | s :: a', t :: b' =>
      (phi s =? phi t)%nat && same_box (inputs_in s) (inputs_in t) && (fewest s =? fewest t)%Z
      && (Meaning.most s =? Meaning.most t)%Z && same_terms_in_boxes a' b'
  | [], [] => true
  | _, _ => false
  end.
Definition may_be_there (t : term) : bool := negb (Meaning.most t =? 0)%Z.
Fixpoint find_slope_among (accepted : list claim) (p rho : nat) (moves : list bool) (b : box) (others : list term) :
    option dyadic :=
  match accepted with
  | [] => None
  | Slope_among q k m [] c ts u :: rest =>
      if (p =? q)%nat && (rho =? k)%nat && same_moves moves m && same_box b c
         && same_terms_in_boxes (filter may_be_there others) ts
      then Some u else find_slope_among rest p rho moves b others
  | _ :: rest => find_slope_among rest p rho moves b others
  end.
Fixpoint total_among (accepted : list claim) (squares : bool) (before kinds : list (kind * box * Z)) (rho : nat) :
    option dyadic :=
  match kinds with
  | [] => Some zero
  | k :: kinds' =>
      let '(p, moves, n, b, least) := k in
      let any := find_slope_in accepted p rho moves b in
      let bound := match find_slope_among accepted p rho moves b (others_of before k kinds') with
                   | Some u => less_of u any | None => any end in
      match bound, total_among accepted squares (before ++ [k]) kinds' rho with
      | Some u, Some rest =>
          if is_nonnegative u && (0 <=? n)%Z then Some (add (mul (n, 0%Z) (if squares then mul u u else u)) rest)
          else None
      | _, _ => None
      end
  end.
Definition check_law_among ps accepted (stacked : bool) kinds rho u : bool :=
  is_nonnegative u && fits_part (part_at ps rho)
  && match total_among accepted stacked [] kinds rho with
     | Some s => at_most s (if stacked then mul u u else u)
     | None => false
     end.

(** In a box, from bounds in its two parts. *)
Definition same_function (f g : function) : bool :=
  match f, g with
  | Alone p, Alone q => (p =? q)%nat
  | Set_of p k, Set_of q l => (p =? q)%nat && (k =? l)%nat
  | _, _ => false
  end.
Fixpoint has_slope_in (accepted : list claim) f moves scale (b : box) u : bool :=
  match accepted with
  | [] => false
  | Slope_in_box g n s c v :: rest =>
      same_function f g && same_moves moves n && same_numbers scale s && same_box b c && at_most v u
      || has_slope_in rest f moves scale b u
  | _ :: rest => has_slope_in rest f moves scale b u
  end.
Definition check_halves ps accepted f moves scale (b : box) u (k : nat) (m : dyadic) : bool :=
  well_formed ps f moves scale && has_slope_in accepted f moves scale (cut k m false b) u
  && has_slope_in accepted f moves scale (cut k m true b) u.

(** Values over boxes. *)
Fixpoint find_within (accepted : list claim) (p : nat) (b : box) : option box :=
  match accepted with
  | [] => None
  | Within q c v :: rest => if (p =? q)%nat && same_box b c then Some v else find_within rest p b
  | _ :: rest => find_within rest p b
  end.
Fixpoint find_error (in_order : bool) (accepted : list claim) (p : nat) (b : box) (r : list dyadic)
    : option (list dyadic * dyadic) :=
  match accepted with
  | [] => None
  | Float_error o q c s e u :: rest =>
      if eqb in_order o && (p =? q)%nat && same_box b c && same_numbers r s then Some (e, u)
      else find_error in_order rest p b r
  | _ :: rest => find_error in_order rest p b r
  end.
(** A bound of a part by itself, for any change of its inputs. *)
Fixpoint find_alone (accepted : list claim) (p n : nat) : option dyadic :=
  match accepted with
  | [] => None
  | Slope_at_most (Alone q) moves [] u :: rest =>
      if (p =? q)%nat && forallb (fun m => m) moves && (length moves =? n)%nat then Some u else find_alone rest p n
  | _ :: rest => find_alone rest p n
  end.
(** The intervals of the terms' sum. *)
Fixpoint sum_ends (accepted : list claim) (n : nat) (terms : list term) : option box :=
  match terms with
  | [] => Some (repeat (zero, zero) n)
  | Term p b low high :: terms' =>
      match find_within accepted p b, sum_ends accepted n terms' with
      | Some v, Some s =>
          if ((length v =? n)%nat && (0 <=? low)%Z && (low <=? high)%Z)%bool then Some (add_ends low high v s) else
            None
      | _, _ => None
      end
  end.
Definition check_within ps p b bounds v : bool :=
  let q := part_at ps p in
  let c := clamp_ends (clamp q) b in
  if relu_between q then check_layers (hidden q) (outer q) c bounds v
  else check_layers_centred (between q) (hidden q) (outer q) c bounds v.
(** How many terms of network p there are, by the fewest or the most of each entry. *)
Definition number_of (number : term -> Z) (p : nat) (terms : list term) : Z :=
  fold_right (fun t n => if (phi t =? p)%nat then (number t + n)%Z else n) 0%Z terms.
Definition times_in (p : nat) (those : list nat) : Z := size (filter (Nat.eqb p) those).
Definition may_be_silent (silent : list (list nat)) (terms : list term) : bool :=
  existsb (fun c => forallb (fun p =>
    (number_of fewest p terms <=? times_in p c)%Z && (times_in p c <=? number_of Meaning.most p terms)%Z)
    (c ++ map phi terms)) silent.
(** Every choice of numbers of terms, each up to n, and whether all are silent. *)
Definition choices_of (n : nat) (t : term) : list (list nat) :=
  filter (fun c => (fewest t <=? size c)%Z && (size c <=? Meaning.most t)%Z) (map (repeat (phi t)) (seq 0 (S n))).
Fixpoint all_choices (n : nat) (terms : list term) : list (list nat) :=
  match terms with
  | [] => [[]]
  | t :: terms' => flat_map (fun c => map (app c) (all_choices n terms')) (choices_of n t)
  end.
Definition always_silent (silent : list (list nat)) (terms : list term) : bool :=
  let longest := fold_right (fun c n => max (length c) n) O silent in
  if forallb (fun t => (Meaning.most t <=? size (repeat O longest))%Z) terms
  then forallb (is_silent silent) (all_choices longest terms) else false.
Definition check_sum_within ps accepted silent terms rho v sums : bool :=
  match sum_ends accepted (inputs_of (part_at ps rho)) terms, find_within accepted rho sums with
  | Some s, Some w =>
      contains sums s && (contains v w || always_silent silent terms)
      && (negb (may_be_silent silent terms) || contains v (repeat (zero, zero) (outputs_of (part_at ps rho))))
  | _, _ => false
  end.
Definition check_jump ps accepted p b rho u : bool :=
  match find_within accepted p b, find_alone accepted rho (inputs_of (part_at ps rho)) with
  | Some v, Some k =>
      (length v =? inputs_of (part_at ps rho))%nat && is_nonnegative k && is_nonnegative u
      && at_most (mul (mul k k) (squareD (map largest_abs v))) (mul u u)
  | _, _ => false
  end.
(** One term more or less, where one of the two sums is silent: the value at the other. *)
Fixpoint find_jump (accepted : list claim) (p : nat) (b : box) (rho : nat) : option dyadic :=
  match accepted with
  | [] => None
  | Jump_at_most q c k u :: rest =>
      if ((p =? q) && (rho =? k))%nat && same_box b c then Some u else find_jump rest p b rho
  | _ :: rest => find_jump rest p b rho
  end.
Fixpoint without (p : nat) (those : list nat) : list nat :=
  match those with [] => [] | q :: those' => if (p =? q)%nat then those' else q :: without p those' end.
Definition beside (silent : list (list nat)) (p : nat) : list (list nat) :=
  filter (fun c => negb (is_silent silent c))
    (flat_map (fun c => (p :: c) :: if (count_of p c =? 0)%nat then [] else [without p c]) silent).
(** One of each. *)
Fixpoint terms_of (boxes : list (nat * box)) (those : list nat) : option (list term) :=
  match those with
  | [] => Some []
  | p :: those' =>
      match box_of boxes p, terms_of boxes those' with
      | Some b, Some ts => Some (Term p b 1%Z 1%Z :: ts)
      | _, _ => None
      end
  end.
Definition check_value_among ps accepted boxes rho u (those : list nat) (sums : box) : bool :=
  match terms_of boxes those with
  | Some ts =>
      match sum_ends accepted (inputs_of (part_at ps rho)) ts, find_within accepted rho sums with
      | Some s, Some w => contains sums s && at_most (squareD (map largest_abs w)) (mul u u)
      | _, _ => false
      end
  | None => false
  end.
Fixpoint check_all_among ps accepted boxes rho u (compositions : list (list nat)) (sums : list box) : bool :=
  match compositions, sums with
  | [], [] => true
  | c :: compositions', s :: sums' =>
      check_value_among ps accepted boxes rho u c s && check_all_among ps accepted boxes rho u compositions' sums'
  | _, _ => false
  end.
Definition check_step ps accepted silent boxes p rho u sums : bool :=
  is_nonnegative u
  && forallb (fun b => fits_part (part_at ps (fst b)) && (outputs_of (part_at ps (fst b)) =? inputs_of (part_at ps
    rho))%nat) boxes
  && match box_of boxes p with
     | Some b => match find_jump accepted p b rho with Some w => at_most w u | None => false end
     | None => false
     end
  && check_all_among ps accepted boxes rho u (beside silent p) sums.
(** The norm of each layer. *)
Fixpoint list_norms (accepted : list claim) (p layer : nat) (ls : list layerD) : option (list dyadic) :=
  match ls with
  | [] => Some []
  | _ :: ls' =>
      match find_norm accepted p layer, list_norms accepted p (S layer) ls' with
      | Some u, Some us => if is_nonnegative u then Some (u :: us) else None
      | _, _ => None
      end
  end.
(** A bound of what follows the clamp. *)
Definition unclamped_slope ps (accepted : list claim) (p : nat) : option dyadic :=
  let q := part_at ps p in
  match (if is_nil (clamp q) then find_alone accepted p (inputs_of q) else None) with
  | Some k => Some k
  | None => norm_of ps accepted p
  end.
(** What the errors r of the inputs come to, at most `moved` in norm, and what the layers add, at most `made`. *)
Definition check_error ps accepted in_order p b r e u bounds errors moved offs made : bool :=
  let q := part_at ps p in
  relu_between q && fits_part q
  && match list_norms accepted p O (layers q), unclamped_slope ps accepted p with
     | Some ns, Some k =>
         check_roundings in_order (hidden q) (outer q) (clamp_ends (clamp q) b) r bounds errors e ns zero offs made
         && is_nonnegative u && is_nonnegative k && is_nonnegative moved && at_most (squareD r) (mul moved moved)
         && (length r =? inputs_of q)%nat
         && (at_most (squareD e) (mul u u) || at_most (add (mul k moved) made) u)
     | _, _ => false
     end.
(** How many summands at most, the sum of their sizes and that of their errors. *)
Fixpoint sum_errors (in_order : bool) (accepted : list claim) (n : nat) (terms : list (term * list dyadic)) :
    option (Z * list dyadic * list dyadic) :=
  match terms with
  | [] => Some (1%Z, repeat zero n, repeat zero n)
  | (Term p b low high, r) :: terms' =>
      match find_within accepted p b, find_error in_order accepted p b r, sum_errors in_order accepted n terms' with
      | Some v, Some (e, _), Some (count, m, s) =>
          if ((length v =? n)%nat && (length e =? n)%nat && (0 <=? high)%Z && forallb is_nonnegative e)%bool then
            Some ((high + count)%Z, plus add (scale mul (high, 0%Z) (sizes v e)) m, plus add (scale mul (high,
              0%Z) e) s)
          else None
      | _, _, _ => None
      end
  end.
Definition check_sum_error ps accepted in_order terms rho u sums errors : bool :=
  let n := inputs_of (part_at ps rho) in
  match sum_ends accepted n (map fst terms), sum_errors in_order accepted n terms,
    find_error in_order accepted rho sums errors with
  | Some s, Some (count, m, e), Some (_, w) =>
      contains sums s && is_nil (clamp (part_at ps rho)) && (length errors =? n)%nat
      && sum_fits count m e errors && at_most w u
  | _, _, _ => false
  end.

Definition check_claim (ps : list part) (accepted : list claim) (c : claim) (p : proof) : bool :=
  match c, p with
  | Norm_at_most p layer u, By_inequality rho t f => check [] [] (matrix_at ps p layer) u rho t f
  | Norm_at_least p layer l, By_vector v => check_norm_below (matrix_at ps p layer) l v
  | Slope_at_most f moves scale u, By_inequality rho t r => check_slope ps f moves scale u rho t r
  | Slope_at_most f moves scale u, By_product => check_product ps accepted f moves scale u
  | Slope_at_most f moves scale u, By_all_parts r form o radius ts => check_parts_of_all ps f moves scale u r form o
    radius ts
  | Slope_in_box f moves scale b u, By_local_product => check_local_product ps accepted f moves scale b u
  | Slope_in_box f moves scale b u, By_local_inequality rho t r => check_local_slope ps f moves scale b u rho t r
  | Slope_in_box f moves scale b u, By_parts r form o t => check_parts_of_box ps f moves scale b u r form o t
  | Slope_in_box f moves scale b u, By_halves k m => check_halves ps accepted f moves scale b u k m
  | Slope_at_least silent f moves scale l, By_points x y others => check_points ps silent f moves scale l x y others
  | Law stacked kinds rho u, By_triangle => check_law ps accepted stacked kinds rho u
  | Law_in_box stacked kinds rho u, By_triangle => check_law_in_box ps accepted stacked kinds rho u
  | Within p b v, By_layers bounds => check_within ps p b bounds v
  | Sum_within silent terms rho v, By_sum sums => check_sum_within ps accepted silent terms rho v sums
  | Jump_at_most p b rho u, By_norm => check_jump ps accepted p b rho u
  | Float_error in_order p b r e u, By_roundings bounds errors moved offs made =>
      check_error ps accepted in_order p b r e u bounds errors moved offs made
  | Sum_float_error in_order terms rho u, By_rounded_sum sums errors =>
      check_sum_error ps accepted in_order terms rho u sums errors
  | Slope_among p rho moves scale b others u, By_parts_among r o ranges t =>
      check_slope_among ps p rho moves scale b others u r o ranges t
  | Law_among stacked kinds rho u, By_triangle => check_law_among ps accepted stacked kinds rho u
  | Step_at_most silent boxes p rho u, By_steps sums => check_step ps accepted silent boxes p rho u sums
  | _, _ => false
  end.
(** The claims accepted so far with one more, if it is proved. *)
Definition step (ps : list part) (accepted : list claim) (c : claim) (p : proof) : option (list claim) :=
  if check_claim ps accepted c p then Some (c :: accepted) else None.
(** All of them, in this order. *)
Fixpoint check_all (ps : list part) (accepted : list claim) (cs : list (claim * proof)) : bool :=
  match cs with
  | [] => true
  | (c, p) :: cs' => check_claim ps accepted c p && check_all ps (c :: accepted) cs'
  end.
