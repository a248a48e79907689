(** Values over a box of networks with any activations: intervals of the layers, and linear forms around the middle of
    the box whose errors shrink with its square. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Exponential Activations Algebra Form Network Checker Fixed Meaning Steepness Sets Lower
    Values Enclosures Intervals Derivatives.
Import ListNotations.
Open Scope Z_scope.

Definition half (x : dyadic) : dyadic := shift (-1) x.
Definition fits_layer (l : layerD) : bool := (length (snd l) =? length (fst l))%nat.
Definition grid : dyadic := (1, -64).
(** y = dot slope d + middle + e, |e| <= error, for the distance d of the inputs from the middle of the box. *)
Record linear := Linear { slope : list dyadic; middle : dyadic; error : dyadic }.
(** One number of a layer: an interval, and a form. *)
Definition known := ((dyadic * dyadic) * linear)%type.

(** k inputs are in front of these. *)
Fixpoint inputs_known (k : nat) (b : box) : list known :=
  match b with
  | [] => []
  | i :: b' => (i, Linear (repeat zero k ++ [one]) (half (add (fst i) (snd i))) zero) :: inputs_known (S k) b'
  end.
Definition radius_of (b : box) : list dyadic := map (fun i => half (add (snd i) (neg (fst i)))) b.
(** What rounding a form's numbers to multiples of 2^-64 costs. *)
Definition rounding_of (radius : list dyadic) : dyadic := mul grid (add one (total radius)).

Fixpoint row_form (row : list dyadic) (s : list known) : linear :=
  match row, s with
  | w :: row', n :: s' =>
      let f := row_form row' s' in
      Linear (plus add (scale mul w (slope (snd n))) (slope f)) (add (mul w (middle (snd n))) (middle f))
        (add (mul (abs w) (error (snd n))) (error f))
  | _, _ => Linear [] zero zero
  end.
Definition rounded (rounding : dyadic) (f : linear) : linear :=
  Linear (map (floor_to (-64)) (slope f)) (floor_to (-64) (middle f)) (ceil_to (-64) (add (error f) rounding)).
(** What the form says, and the interval as well. *)
Definition met (radius : list dyadic) (i : dyadic * dyadic) (f : linear) : known :=
  let spread := add (error f) (dot zero add mul (map abs (slope f)) radius) in
  ((larger (fst i) (add (middle f) (neg spread)), smaller (snd i) (add (middle f) spread)), f).
Fixpoint passed (radius : list dyadic) (rounding : dyadic) (w : matrixD) (c : list dyadic) (s : list known) :
    list known :=
  match w, c with
  | row :: w', a :: c' =>
      let (l, h) := row_ends row (map fst s) in
      let f := row_form row s in
      met radius (add l a, add h a) (rounded rounding (Linear (slope f) (add (middle f) a) (error f)))
      :: passed radius rounding w' c' s
  | _, _ => []
  end.

Definition ends_of (a : activation) (i : dyadic * dyadic) : dyadic * dyadic :=
  match a with Relu => relu_ends i | _ => values_between a i end.
(** With p the middle of the form, moved into the interval, s(y) - s(p) is the mean slope times y - p, but for half of
    the range of slopes. *)
Definition activated_form (a : activation) (rounding : dyadic) (n : known) : known :=
  let '(i, f) := n in
  let p := larger (fst i) (smaller (middle f) (snd i)) in
  let (l, h) := slopes_between a i in
  let v := ends_of a (p, p) in
  let mean := half (add l h) in
  let reach := larger (add (snd i) (neg p)) (add p (neg (fst i))) in
  (ends_of a i,
   rounded rounding (Linear (scale mul mean (slope f)) (add (fst v) (mul mean (add (middle f) (neg p))))
     (add (mul (abs mean) (error f)) (add (mul (half (add h (neg l))) reach) (add (snd v) (neg (fst v))))))).
Definition constant_form (i : dyadic * dyadic) : known :=
  (i, Linear [] (floor_to (-64) (half (add (fst i) (snd i))))
        (add (ceil_to (-64) (half (add (snd i) (neg (fst i))))) grid)).
Fixpoint activated_known (a : activation) (rounding : dyadic) (s : list known) : list known :=
  match a with
  | Sorted k => map constant_form (sorted_by least_ends greatest_ends k (map fst s))
  | Keeping n b => activated_known b rounding (firstn n s) ++ skipn n s
  | _ => map (activated_form a rounding) s
  end.
Fixpoint contains_known (a : box) (s : list known) : bool :=
  match a, s with
  | (l, h) :: a', ((m, k), _) :: s' => at_most l m && at_most k h && contains_known a' s'
  | [], [] => true
  | _, _ => false
  end.
Fixpoint check_centred (radius : list dyadic) (rounding : dyadic) (between : list activation) (hidden : list layerD)
    (last : layerD) (s : list known) (bounds : list box) (v : box) : bool :=
  match hidden, bounds with
  | [], [] => fits_layer last && contains_known v (passed radius rounding (fst last) (snd last) s)
  | l :: hidden', b :: bounds' =>
      let t := passed radius rounding (fst l) (snd l) s in
      fits_layer l && contains_known b t
      && check_centred radius rounding (tl between) hidden' last (activated_known (hd Relu between) rounding t)
        bounds' v
  | _, _ => false
  end.
Definition check_layers_centred (between : list activation) (hidden : list layerD) (last : layerD) (b : box)
    (bounds : list box) (v : box) : bool :=
  let radius := radius_of b in
  check_centred radius (rounding_of radius) between hidden last (inputs_known 0 b) bounds v.

Open Scope R_scope.
Lemma real_half x : real (half x) = real x / 2.
Proof. unfold half. rewrite real_shift. replace (powerRZ 2 (-1)) with (/ 2) by (simpl; field). lra. Qed.
Definition bounded_by (radius : list dyadic) (d : list R) : Prop := Forall2 (fun r a => Rabs a <= real r) radius d.
Definition form_at (f : linear) (d : list R) : R := dotR (reals (slope f)) d + real (middle f).
Definition near (d : list R) (f : linear) (y : R) : Prop := Rabs (y - form_at f d) <= real (error f).
Definition follows (d : list R) (n : known) (y : R) : Prop := lies (fst n) y /\ near d (snd n) y.

Lemma total_nonneg radius d : bounded_by radius d -> 0 <= real (total radius).
Proof.
  intros H. induction H as [|r a radius d H _ IH]; cbn [total fold_right]; [rewrite real_zero; lra|].
  rewrite real_add. pose proof (Rabs_pos a). unfold total in IH. lra.
Qed.
Lemma floor_to_near x : 0 <= real x - real (floor_to (-64) x) <= real grid.
Proof.
  split; [pose proof (floor_to_below (-64) x); lra|]. pose proof (floor_to_close (-64) x). unfold grid. lra.
Qed.
Lemma grid_positive : 0 < real grid. Proof. apply real_positive. reflexivity. Qed.
Lemma dot_floor g radius d : bounded_by radius d ->
  Rabs (dotR (reals g) d - dotR (reals (map (floor_to (-64)) g)) d) <= real grid * real (total radius).
Proof.
  intros H. revert g. pose proof grid_positive as P. induction H as [|r a radius d H F IH]; intros g.
  - destruct g; simpl; rewrite Rminus_diag_eq, Rabs_R0 by auto; unfold total; simpl; rewrite real_zero; lra.
  - pose proof (total_nonneg _ _ F). destruct g as [|x g].
    + simpl. rewrite Rminus_diag_eq, Rabs_R0 by auto. pose proof (total_nonneg (r :: radius) (a :: d)).
      apply Rmult_le_pos; [lra|]. apply H1. now constructor.
    + cbn [map dot]. specialize (IH g). cbn [total fold_right]. fold (total radius). rewrite real_add.
      pose proof (floor_to_near x). set (u := dotR (reals g) d) in *. set (v := dotR (reals (map _ g)) d) in *.
      replace (real x * a + u - (real (floor_to (-64) x) * a + v)) with ((real x - real (floor_to (-64) x)) * a + (u -
        v))
        by ring.
      eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_mult, (Rabs_pos_eq (_ - _)) by lra.
      assert ((real x - real (floor_to (-64) x)) * Rabs a <= real grid * real r); [|lra].
      apply Rmult_le_compat; try lra. apply Rabs_pos.
Qed.
Lemma rounded_near radius d f y : bounded_by radius d -> near d f y -> near d (rounded (rounding_of radius) f) y.
Proof.
  unfold near, form_at, rounded. cbn [slope middle error]. intros B H.
  pose proof (dot_floor (slope f) radius d B) as G. pose proof (floor_to_near (middle f)) as M.
  pose proof (ceil_to_above (-64) (add (error f) (rounding_of radius))) as C.
  unfold rounding_of in *. rewrite real_add, real_mul, real_add, real_one in C.
  set (u := dotR (reals (slope f)) d) in *.
  set (v := dotR (reals (map (floor_to (-64)) (slope f))) d) in *. set (m := real (floor_to (-64) (middle f))) in *.
  replace (y - (v + m)) with (y - (u + real (middle f)) + ((u - v) + (real (middle f) - m))) by ring.
  eapply Rle_trans; [apply Rabs_triang|]. pose proof (Rabs_triang (u - v) (real (middle f) - m)) as T.
  rewrite (Rabs_pos_eq (real (middle f) - m)) in T by lra. lra.
Qed.
Lemma dot_spread g radius d : bounded_by radius d ->
  Rabs (dotR (reals g) d) <= real (dot zero add mul (map abs g) radius).
Proof.
  intros H. revert g. induction H as [|r a radius d H F IH]; intros [|x g]; simpl;
    try (rewrite Rabs_R0, real_zero; lra).
  rewrite real_add, real_mul, real_abs. eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_mult.
  pose proof (Rmult_le_compat_l _ _ _ (Rabs_pos (real x)) H). specialize (IH g). lra.
Qed.
Lemma Rabs_between x r : Rabs x <= r -> - r <= x <= r.
Proof. intros H. pose proof (Rle_abs x). pose proof (Rle_abs (- x)) as N. rewrite Rabs_Ropp in N. lra. Qed.
Lemma met_follows radius d i f y : bounded_by radius d -> lies i y -> near d f y -> follows d (met radius i f) y.
Proof.
  intros B [L H] N. split; [|exact N]. unfold met, lies. cbn [fst snd].
  rewrite real_larger, real_smaller, !real_add, real_neg, !real_add. pose proof (dot_spread (slope f) radius d B) as S.
  unfold near, form_at in N. set (u := dotR (reals (slope f)) d) in *.
  set (s := real (dot zero add mul (map abs (slope f)) radius)) in *.
  apply Rabs_between in N. apply Rabs_between in S. split; [apply Rmax_lub|apply Rmin_glb]; lra.
Qed.
Lemma row_near d s h row : Forall2 (follows d) s h -> near d (row_form row s) (dotR (reals row) h).
Proof.
  unfold near, form_at. intros H. revert row. induction H as [|n y s h [_ N] H IH]; intros [|w row]; simpl;
    try (rewrite real_zero, !Rplus_0_r, Rminus_diag_eq, Rabs_R0 by auto; lra).
  specialize (IH row). set (f := row_form row s) in *. rewrite (f_plus add Rplus real real_add),
    (f_scale mul Rmult real real_mul), dot_plus_l, dot_scale_l, !real_add, !real_mul, real_abs.
  unfold near, form_at in N. set (u := dotR (reals (slope (snd n))) d) in *. set (v := dotR (reals (slope f)) d) in *.
  replace (real w * y + dotR (reals row) h - (real w * u + v + (real w * real (middle (snd n)) + real (middle f))))
    with (real w * (y - (u + real (middle (snd n)))) + (dotR (reals row) h - (v + real (middle f)))) by ring.
  eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_mult.
  pose proof (Rmult_le_compat_l _ _ _ (Rabs_pos (real w)) N). lra.
Qed.
Lemma follows_within d s h : Forall2 (follows d) s h -> within (map fst s) h.
Proof. intros H. rewrite within_lies. induction H as [|n y s h [L _] H IH]; simpl; constructor; auto. Qed.
Lemma passed_follow radius d w c s h : bounded_by radius d -> length c = length w -> Forall2 (follows d) s h ->
  Forall2 (follows d) (passed radius (rounding_of radius) w c s) (affine (realm w) (reals c) h).
Proof.
  intros B L H. revert c L. induction w as [|row w IH]; intros [|a c] L; try discriminate; [constructor|].
  cbn [passed]. pose proof (row_ends_within row _ _ (follows_within d s h H)) as E.
  destruct (row_ends row (map fst s)) as [l k]. cbn [fst snd] in E. simpl affine. constructor; [|apply IH; auto].
  apply met_follows; auto.
  - unfold lies. cbn [fst snd]. rewrite !real_add. lra.
  - apply rounded_near; auto. pose proof (row_near d s h row H) as N. unfold near, form_at in *.
  cbn [slope middle error].
    rewrite real_add. replace (dotR (reals row) h + real a - _) with
      (dotR (reals row) h - (dotR (reals (slope (row_form row s))) d + real (middle (row_form row s)))) by ring.
      exact N.
Qed.

Lemma ends_of_lie a i y : is_entrywise a = true -> lies i y -> lies (ends_of a i) (act a y).
Proof.
  intros E H. destruct (is_relu a) eqn:R.
  - destruct a; try discriminate. destruct H as [L H]. unfold lies, ends_of, relu_ends. cbn [fst snd act].
    rewrite !real_relu. unfold relu. split; apply Rle_max_compat_l; auto.
  - pose proof (values_between_lies a i y R E H). destruct a; try discriminate; assumption.
Qed.
Lemma activated_form_follows a radius d n y : bounded_by radius d -> is_entrywise a = true -> follows d n y ->
  follows d (activated_form a (rounding_of radius) n) (act a y).
Proof.
  intros B E [L N]. destruct n as [i f].
  cbn [fst snd] in *. unfold activated_form. pose proof (slopes_between_hold a i E) as K.
  destruct (slopes_between a i) as [l h]. cbn [fst snd] in K. split; cbn [fst snd]; [now apply ends_of_lie|].
  set (p := larger (fst i) (smaller (middle f) (snd i))).
  assert (real (fst i) <= real p <= real (snd i)) as P.
  { destruct L as [L1 L2]. unfold p. rewrite real_larger, real_smaller. split; [apply Rmax_l|].
    apply Rmax_lub; [lra|apply Rmin_r]. }
  assert (lies (p, p) (real p)) as Pp by (split; simpl; lra). pose proof (ends_of_lie a _ _ E Pp) as V.
  set (v := ends_of a (p, p)) in *. destruct V as [V1 V2]. apply rounded_near; auto.
  unfold near, form_at in *. cbn [slope middle error].
  rewrite (f_scale mul Rmult real real_mul), dot_scale_l, !real_add, !real_mul, !real_half, !real_add, !real_abs,
    !real_half,
    !real_neg, real_larger, !real_add, !real_neg.
  set (u := dotR (reals (slope f)) d) in *. set (m := (real l + real h) / 2) in *.
  set (r := Rmax _ _). set (q := real p) in *. clearbody q.
  assert (Rabs (act a y - act a q - m * (y - q)) <= (real h + - real l) / 2 * r) as D.
  { destruct L as [L1 L2]. pose proof (Rmax_l (real (snd i) + - q) (q + - real (fst i))) as R1.
    pose proof (Rmax_r (real (snd i) + - q) (q + - real (fst i))) as R2. fold r in R1, R2.
    destruct (Rle_lt_dec (real (snd i)) (real (fst i))) as [O|O].
    - assert (r = 0) as -> by (unfold r, Rmax; destruct (Rle_dec _ _); lra). replace y with q by lra.
      rewrite Rmult_0_r. replace (act a q - act a q - m * (q - q)) with 0 by ring. rewrite Rabs_R0. lra.
    - destruct (K (real (fst i)) (real (snd i)) ltac:(lra) ltac:(lra) ltac:(lra)) as [K1 K2].
      assert (real l <= real h) as Q by (apply (Rmult_le_reg_r (real (snd i) - real (fst i))); lra).
      assert (forall z, 0 <= z <= r -> (real h + - real l) / 2 * z <= (real h + - real l) / 2 * r) as W
        by (intros z Hz; apply Rmult_le_compat_l; lra).
      apply Rabs_le. unfold m. destruct (Rle_lt_dec q y) as [T|T].
      + destruct (K q y ltac:(lra) T ltac:(lra)). specialize (W (y - q) ltac:(lra)). lra.
      + destruct (K y q ltac:(lra) ltac:(lra) ltac:(lra)). specialize (W (q - y) ltac:(lra)). lra. }
  clearbody r. set (x := act a y) in *. set (z := act a q) in *. clearbody x z.
  replace (x - (m * u + (real (fst v) + m * (real (middle f) + - q)))) with
    ((x - z - m * (y - q)) + (m * (y - (u + real (middle f))) + (z - real (fst v)))) by ring.
  eapply Rle_trans; [apply Rabs_triang|]. pose proof (Rabs_triang (m * (y - (u + real (middle f)))) (z - real (fst
    v))) as T.
  rewrite Rabs_mult, (Rabs_pos_eq (z - real (fst v))) in T by lra.
  pose proof (Rmult_le_compat_l _ _ _ (Rabs_pos m) N). lra.
Qed.
Lemma constant_form_follows d i y : lies i y -> follows d (constant_form i) y.
Proof.
  intros [L H]. split; [split; assumption|]. unfold near, form_at, constant_form. cbn [slope middle error snd map dot].
  pose proof (floor_to_near (half (add (fst i) (snd i)))) as F.
  pose proof (ceil_to_above (-64) (half (add (snd i) (neg (fst i))))) as C.
  rewrite real_half, real_add in F. rewrite real_half, real_add, real_neg in C. rewrite real_add. apply Rabs_le. lra.
Qed.
Lemma activated_known_follow a radius d s y : bounded_by radius d -> Forall2 (follows d) s y ->
  Forall2 (follows d) (activated_known a (rounding_of radius) s) (activated a y).
Proof.
  intros B. assert (forall c s y, is_entrywise c = true -> Forall2 (follows d) s y ->
    Forall2 (follows d) (map (activated_form c (rounding_of radius)) s) (map (act c) y)) as F.
  { clear - B. intros c s y E H. induction H; simpl; constructor; auto. now apply activated_form_follows. }
  revert s y. induction a as [| | | | | | | |k|n a IH]; intros s y H; try (now apply F);
    cbn [activated_known activated].
  - apply follows_within in H. apply (sorted_within k) in H. rewrite within_lies in H.
    induction H; simpl; constructor; auto. now apply constant_form_follows.
  - apply Forall2_app; [apply IH; now apply related_firstn|now apply related_skipn].
Qed.
Lemma contains_known_within d a s y : contains_known a s = true -> Forall2 (follows d) s y -> within a y.
Proof.
  intros C H. revert a C. induction H as [|[[l h] f] y s ys [[L1 L2] _] H IH]; intros [|[m k] a]; simpl;
    try discriminate; auto.
  intros C. do 2 both C. apply at_most_real in C, H1. cbn [fst snd] in *. split; [lra|auto].
Qed.
Lemma centred_within radius d between hidden last s bounds v h : bounded_by radius d ->
  Forall2 (follows d) s h ->
  check_centred radius (rounding_of radius) between hidden last s bounds v = true ->
  within v (layer_by_layer between (map real_layer hidden) (real_layer last) h).
Proof.
  intros B. revert between s bounds h. induction hidden as [|l hidden IH]; intros between s [|b bounds] h F; simpl;
    try discriminate; intros C.
  - both C. apply (contains_known_within d _ _ _ H). apply passed_follow; auto. now apply Nat.eqb_eq.
  - do 2 both C. apply (IH (tl between) (activated_known (hd Relu between) (rounding_of radius)
      (passed radius (rounding_of radius) (fst l) (snd l) s)) bounds); auto.
    apply activated_known_follow, passed_follow; auto. now apply Nat.eqb_eq.
Qed.
Lemma dot_unit k : forall pre a (d : list R), length pre = k ->
  dotR (reals (repeat zero k ++ [one])) (pre ++ a :: d) = a.
Proof.
  induction k as [|k IH]; intros [|c pre] a d; simpl; try discriminate.
  - intros _. rewrite real_one. destruct d; ring.
  - intros H. rewrite real_zero, IH by lia. ring.
Qed.
Lemma inputs_follow b : forall x, within b x -> exists d, bounded_by (radius_of b) d /\ length d = length b /\
  forall k pre, length pre = k -> Forall2 (follows (pre ++ d)) (inputs_known k b) x.
Proof.
  induction b as [|[l h] b IH]; intros [|a x]; simpl; try tauto.
  - intros _. exists []. repeat split; constructor.
  - intros [[L H] W]. destruct (IH x W) as (d & B & Ln & F). set (m := real (half (add l h))).
    assert (m = (real l + real h) / 2) as M by (unfold m; now rewrite real_half, real_add).
    exists ((a - m) :: d). split; [|split; [simpl; now rewrite Ln|]].
    + constructor; auto. rewrite real_half, real_add, real_neg. apply Rabs_le. lra.
    + intros k pre Hk. constructor.
      * split; [split; assumption|]. unfold near, form_at. cbn [slope middle error snd]. rewrite dot_unit by auto.
        fold m. replace (a - (a - m + m)) with 0 by ring. rewrite Rabs_R0, real_zero. lra.
      * specialize (F (S k) (pre ++ [a - m])). rewrite <- app_assoc in F. apply F. rewrite app_length. simpl. lia.
Qed.
Theorem centred_sound between hidden last b bounds v x : within b x ->
  check_layers_centred between hidden last b bounds v = true ->
  within v (layer_by_layer between (map real_layer hidden) (real_layer last) x).
Proof.
  intros W C. destruct (inputs_follow b x W) as (d & B & _ & F). specialize (F O [] eq_refl).
  exact (centred_within _ d _ _ _ _ _ _ _ B F C).
Qed.
